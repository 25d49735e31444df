"""Tables -> figures, page, overlay."""
