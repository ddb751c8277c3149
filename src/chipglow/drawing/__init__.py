"""Style of figures, and the frame that they show."""
