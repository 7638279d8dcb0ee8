'use strict';
// Tables that sort: a click on a head, or Enter on it.
for (const table of document.querySelectorAll('table.sortable')) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.tabIndex = 0;
    const key = row => {
      const cell = row.cells[column], text = cell.textContent.trim();
      const number = parseFloat(cell.dataset.value !== undefined ? cell.dataset.value : text.replace('\u2212', '-'));
      return Number.isNaN(number) ? text : number;
    };
    const sort = () => {
      const down = head.getAttribute('aria-sort') === 'ascending';
      heads.forEach(h => h.removeAttribute('aria-sort'));
      head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      const rows = [...table.tBodies[0].rows].map((row, i) => ({row, i, key: key(row)}));
      rows.sort((a, b) => {
        const order = typeof a.key === typeof b.key ? (a.key < b.key ? -1 : a.key > b.key ? 1 : 0)
          : typeof a.key === 'number' ? -1 : 1;
        return order === 0 ? a.i - b.i : down ? -order : order;
      });
      rows.forEach(r => table.tBodies[0].append(r.row));
    };
    head.addEventListener('click', sort);
    head.addEventListener('keydown', e => { if (e.key === 'Enter') sort(); });
  });
}
