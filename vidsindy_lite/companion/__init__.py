"""What turns notebooks into a book, and a discovery into a report.

`run` executes the notebooks, whose cells hand their results to `artifacts`; `compare` says where
two runs differ, and puts what does in place. `report`, `play` and `pick` write pages for those who
film. Words and marks stand in templates (`pages`), beside the module that fills them.
"""
