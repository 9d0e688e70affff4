/* In a narrow window a row of a table becomes a block (wide.css), so each cell carries the heading of its column. Names
   of more than twenty letters may break after a dot, bracket or underscore and before a capital, but nowhere else. */
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll("table.table")) {
    const heads = [...table.querySelectorAll("thead th")].map((head) => head.textContent.trim());
    for (const row of table.tBodies[0].rows)
      [...row.cells].forEach((cell, k) => {
        cell.dataset.head = k ? heads[k] : "";
        cell.classList.toggle("without", ["", "-"].includes(cell.textContent.trim()));
      });
  }
  const texts = document.createTreeWalker(document.querySelector("article"), NodeFilter.SHOW_TEXT);
  const names = [];
  while (texts.nextNode())
    if (texts.currentNode.parentElement.closest("td, code, h1, h2, h3") && !texts.currentNode.parentElement.closest("pre, a"))
      names.push(texts.currentNode);
  const places = /(?<=[a-z)\]][._([])(?=[A-Za-z]{3})|(?<=[a-z])(?=[A-Z][a-z])/;
  for (const name of names) {
    const parts = name.data.split(/(\S{21,})/).flatMap((word, k) => (k % 2 ? word.split(places) : [word]));
    if (parts.length > 1) name.replaceWith(...parts.flatMap((part) => [document.createElement("wbr"), part]).slice(1));
  }
});
