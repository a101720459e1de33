"""The command line: a verb is one file of `verbs`; what verbs share lies beside it."""
