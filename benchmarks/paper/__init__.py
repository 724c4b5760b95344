"""The figures of the reference paper, with the scenes and methods of this library.

Tasora: Efficient simulation of contacts, friction and constraints using a modified spectral projected
gradient method, WSCG 2013.
"""
