"""Runs of `composer test`: which cases run, and how."""
