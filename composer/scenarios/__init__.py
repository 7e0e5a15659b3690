"""Scenario files (`*.scenario.yaml`): what a system is given, and what is expected of it."""
