"""The command: ``crosscheck``. Tables and progress go to stderr, machine output to stdout.

One module per group of subcommands; importing it registers them.
"""

from reports.command import (
    accepting,
    benching,
    certifying,
    comparing,
    exporting,
    inspecting,
    keeping,
    releasing,
    reporting,
    running,
    showing,
    sweeping,
    tuning,
)
from reports.command.group import main

__all__ = [
    "accepting",
    "benching",
    "certifying",
    "comparing",
    "exporting",
    "inspecting",
    "keeping",
    "main",
    "releasing",
    "reporting",
    "running",
    "showing",
    "sweeping",
    "tuning",
]
