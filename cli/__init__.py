"""The command line, installed as `kemba_cli`; one file per verb."""
