"""The command: ``crosscheck``. Tables and progress go to stderr, machine output to stdout.

One module per group of subcommands; importing it registers them. `reports.command.group` imports it when one of them is
called.
"""

from reports.command.group import main

__all__ = ["main"]
