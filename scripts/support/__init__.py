"""What the scripts share; they import it from beside themselves."""
