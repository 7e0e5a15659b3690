"""A loaded system → findings; `checker` lists the checks."""
