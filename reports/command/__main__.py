"""Runs the command as ``python -m reports.command``."""

from reports.command import main

main()
