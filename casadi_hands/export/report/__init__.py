"""``report.html``: one page that tells all there is of a design, which needs neither a server nor a network."""
