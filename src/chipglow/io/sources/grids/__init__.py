"""Regular grids: arrays in files of many formats, and which of them is which field."""
