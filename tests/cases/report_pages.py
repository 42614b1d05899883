"""What stands on the page of a report."""

import re


def table(page: str, caption: str) -> list[list[str]]:
    """Cells of the table with a caption, row by row."""
    (body,) = re.findall(rf"<caption>Table \d+\. {re.escape(caption)}.*?<tbody>(.*?)</tbody>", page, re.DOTALL)
    return [re.findall(r"<td.*?>(.*?)</td>", row) for row in re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)]
