"""paper/paper.md, a paper for the Journal of Open Source Software: its form."""

import re


# Breaks when the paper leaves the length that the journal asks for, cites what its bibliography lacks, lists
# what it does not cite, or shows a figure that does not exist.
def test_paper_has_its_form(root):
    text = (root / "paper" / "paper.md").read_text()
    body = text.split("---\n", 2)[2]
    assert 750 <= len(re.findall(r"[\w'-]+", body)) <= 1200
    keys = set(re.findall(r"^@\w+\{(\w+),", (root / "paper" / "paper.bib").read_text(), re.MULTILINE))
    assert set(re.findall(r"\[@(\w+)\]", body)) == keys
    figures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", body)
    assert len(figures) == 2
    assert all((root / "paper" / figure).exists() for figure in figures)
    sections = ("Summary", "Statement of need", "State of the field", "Software design")
    for heading in (*sections, "Research impact statement", "Acknowledgements", "References"):
        assert f"\n# {heading}\n" in body
