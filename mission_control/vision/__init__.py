"""One published algorithm a file: arrays in, arrays out."""
