"""Which physical effect is missing, and how far the error falls once it is added."""
