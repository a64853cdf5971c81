"""The page in a browser: ES modules that `explorer/` serves and a report keeps, and frames."""
