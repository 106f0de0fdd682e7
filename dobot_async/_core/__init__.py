"""What all arms share. Private: its users are the families and what is built on them; no arm is known here."""
