"""Tables that other programs have written: encoding, delimiter, header, clock and columns of a text file, and its usable rows.

What is not given is read off the file and said; what is not certain is refused with what to type.
Messages of MCAP logs are such tables, too.
May import: core, log. May not import: anything else of the project.
"""
