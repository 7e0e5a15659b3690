"""The parameters that commands share."""
