// Tables: sorting by a click on a heading, filters, and download as CSV.

const MOST_CHOICES = 40;

/** The text of a cell in the CSV file. */
function exactOf(cell) {
  const text = cell.dataset.value ?? cell.dataset.column ?? cell.textContent;
  return cell.closest(".data") ? text : text.trim().replace(/\s+/g, " ");
}

/** A cell quoted for CSV, as in harness.evaluation.tables. */
function quoted(text) {
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

function csvOf(heading, rows) {
  return [heading, ...rows].map(row => `${[...row.cells].map(cell => quoted(exactOf(cell))).join(",")}\n`).join("");
}

function download(name, text) {
  const link = make("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Rows in the order of a column: numbers by size, words alphabetically, empty cells last. */
function sorted(rows, place, down) {
  const values = new Map(rows.map(row => [row, exactOf(row.cells[place])]));
  const numeric = [...values.values()].every(value => value === "" || !Number.isNaN(Number(value)));
  const compare = (a, b) => (numeric ? a - b : a.localeCompare(b, undefined, { numeric: true }));
  return [...rows].sort((one, two) => {
    const [a, b] = [values.get(one), values.get(two)];
    if ((a === "") !== (b === "")) return a === "" ? 1 : -1;
    return (down ? -1 : 1) * compare(a, b);
  });
}

function makeSortable(table, rows) {
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, place) => {
    const button = make("button", { type: "button", class: "sort" }, ...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const down = heading.getAttribute("aria-sort") === "ascending";
      for (const each of headings) each.removeAttribute("aria-sort");
      heading.setAttribute("aria-sort", down ? "descending" : "ascending");
      table.tBodies[0].append(...sorted(rows, place, down));
    });
  });
}

/** Filters of the table of games: lists of arms and outcomes, and a field for text. */
function filters(table, rows) {
  const columns = [...table.tHead.rows[0].cells].map(exactOf);
  const bar = make("div", { class: "filters" }), count = make("output");
  const tests = [];
  const apply = () => {
    let shown = 0;
    for (const row of rows) {
      row.hidden = !tests.every(test => test(row));
      shown += !row.hidden;
    }
    count.textContent = `${shown} of ${rows.length} games`;
  };
  for (const name of columns.filter(each => /^(arm|ego_outcome|non_ego(_\d)?_outcome)$/.test(each))) {
    const place = columns.indexOf(name);
    const values = [...new Set(rows.map(row => exactOf(row.cells[place])))];
    if (values.length < 2 || values.length > MOST_CHOICES) continue;
    const select = make("select", {}, make("option", { value: "-1", text: "all" }),
      ...values.map((value, n) => make("option", { value: n, text: value || "–" })));
    select.dataset.filter = name;
    select.addEventListener("change", apply);
    tests.push(row => select.value === "-1" || exactOf(row.cells[place]) === values[select.value]);
    bar.append(make("label", { text: `${name.replace("non_ego", "non-ego").replaceAll("_", " ")} ` }, select));
  }
  const search = make("input", { type: "search", size: "14", "data-filter": "text" });
  const texts = new Map();
  tests.push(row => {
    const wanted = search.value.trim().toLowerCase();
    if (!wanted) return true;
    if (!texts.has(row)) texts.set(row, [...row.cells].map(cell => cell.textContent).join(" ").toLowerCase());
    return wanted.split(/\s+/).every(word => texts.get(row).includes(word));
  });
  search.addEventListener("input", apply);
  bar.append(make("label", { text: "text " }, search), count);
  apply();
  return bar;
}

/** Add download, sorting and filters to a table. */
function equip(table) {
  const region = table.closest(".scroll"), rows = [...table.tBodies[0].rows];
  const save = make("button", { type: "button", text: "Download CSV" });
  const name = `${table.id || table.caption.textContent.trim().toLowerCase().replace(/[^a-z0-9]+/g, "_")}.csv`;
  const [heading, inOrder] = [table.tHead.rows[0], [...rows]];
  save.addEventListener("click", () => download(name, csvOf(heading, inOrder.filter(row => !row.hidden))));
  const bar = table.id === "episodes" ? filters(table, rows) : make("div", { class: "filters" });
  bar.append(save);
  region.before(bar);
  makeSortable(table, rows);
}

for (const table of document.querySelectorAll(".scroll table")) equip(table);

/** Open every folded part that an element is in. */
function unfold(element) {
  for (let each = element?.closest("details"); each; each = each.parentElement.closest("details")) each.open = true;
  for (const each of element?.querySelectorAll(":scope > details.evidence") ?? []) each.open = true;
}

// A link to a folded part opens it.
function unfoldAddressed(hash) {
  const target = document.getElementById(hash.slice(1));
  if (!target) return;
  unfold(target);
  if (target.matches("details")) target.open = true;
}
document.addEventListener("click", event => {
  const link = event.target.closest('a[href^="#"]');
  if (link) unfoldAddressed(link.hash);
});
window.addEventListener("hashchange", () => unfoldAddressed(location.hash));
unfoldAddressed(location.hash);

// On paper the evidence is unfolded.
matchMedia("print").addEventListener("change", event => {
  if (event.matches) for (const each of document.querySelectorAll("details.evidence")) each.open = true;
});
