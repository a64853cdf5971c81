"""criticism: in, results of inferences; out, where a model fails and what would mend it.

Not known here: how results came about. Nothing is imported until it is asked for.
"""
