"""Ways in, for simulators and bridges alike: listening sockets, pseudo-terminals, and the pace of a serial line."""
