"""The library: what `import kemba` offers, each function as the verb of the same name."""
