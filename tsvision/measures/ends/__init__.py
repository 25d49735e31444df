"""Where the strings begin and end: separator, legs, apex, connector."""
