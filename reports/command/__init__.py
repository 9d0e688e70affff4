"""The command: ``crosscheck``. Tables and progress go to stderr, machine output to stdout.

One module per group of subcommands; importing it registers them.
"""

from reports.command import (
    accepting,
    asking,
    benching,
    certifying,
    comparing,
    curing,
    driving,
    exporting,
    guessing,
    inspecting,
    keeping,
    releasing,
    reporting,
    running,
    schema,
    showing,
    sweeping,
    tuning,
    weighing,
)
from reports.command.group import main

__all__ = [
    "accepting",
    "asking",
    "benching",
    "certifying",
    "comparing",
    "curing",
    "driving",
    "exporting",
    "guessing",
    "inspecting",
    "keeping",
    "main",
    "releasing",
    "reporting",
    "running",
    "schema",
    "showing",
    "sweeping",
    "tuning",
    "weighing",
]
