"""A simulated BLE module on a D-Bus of its own: BlueZ, a link layer, and the module between them and the arm."""
