// Nothing of its own: carries the headers that the tests of the core share, compiled once.
