"""What every package needs: checks of arguments, the cache, progress bars, compiled code."""
