"""Problems from the input files of other programs."""
