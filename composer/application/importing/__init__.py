"""The trial of an imported launch file: both run with stand-ins for their programs."""
