"""A second robot for blind tests: other bodies, other integration, other contact, same physics.

It shares no code with the product.  `cases` makes logs with hidden effects;
see `python -m twin -h`.
"""
