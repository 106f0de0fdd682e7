"""One connection to one arm: the link, which reply belongs to which request, and how long an answer may take."""
