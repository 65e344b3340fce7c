"""One room per trained system: from its files to an Avatar. The table READERS is in table.py."""
