"""What every room uses: errors, checks of arguments, dimensions, files, processes, progress."""
