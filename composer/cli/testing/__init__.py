"""`composer test`: find scenario files, check them, run their cases and report."""
