"""Everything shown: the command line, tables, exports, reports. Reads the store and never imports an engine."""
