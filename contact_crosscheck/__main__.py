"""``python -m contact_crosscheck`` is ``crosscheck``."""

from contact_crosscheck import main

main()
