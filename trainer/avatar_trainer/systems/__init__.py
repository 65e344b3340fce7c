"""The systems that the loop trains, a folder each; `table.py` lists them, `protocol.py` says what each offers."""
