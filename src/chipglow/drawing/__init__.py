"""How figures look, and which frame they show."""
