"""The command: ``crosscheck``. Tables and progress go to stderr, machine output to stdout.

One module per group of subcommands; importing it registers them.
"""

from reports.command import benching, certifying, comparing, inspecting, reporting, running, showing
from reports.command.group import main

__all__ = ["benching", "certifying", "comparing", "inspecting", "main", "reporting", "running", "showing"]
