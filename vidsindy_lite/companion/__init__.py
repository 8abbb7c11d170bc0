"""What turns notebooks into a book: each command of it is a module.

`run` executes the notebooks, whose cells hand their results to `artifacts`; `registry` keeps the
folder of figures, `readme` the tables of README and docs/, `claims` what
is said and by which check. `compare`, `report` and `site` write pages.
Words and marks stand in templates (`pages`), beside the module that fills them in.
"""
