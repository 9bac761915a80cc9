"""From a sweep file to its cases."""
