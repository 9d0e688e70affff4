"""Everything shown: the command line, tables, exports, reports. It reads the store and never imports an engine."""

import contact_crosscheck

contact_crosscheck.check()  # every entry point leads through here; `contact_crosscheck` says why
