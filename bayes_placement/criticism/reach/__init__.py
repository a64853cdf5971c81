"""Where something acts that is missing, whatever it is, and by which law."""
