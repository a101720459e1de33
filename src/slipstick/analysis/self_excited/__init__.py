"""Self-excited vibration: steady sliding and limit cycles."""
