// Tables: DataTables sorts, searches and pages them; a table is downloaded as the CSV file that it shows.

const MOST_CHOICES = 40, PAGED_FROM = 100, ROWS_OF_A_PAGE = 50;

/** The text of a cell without its markup. */
function plain(text) {
  return String(text).includes("<") ? String(text).replace(/<[^>]*>/g, " ").trim() : String(text).trim();
}

/** Numbers by size, then words alphabetically; empty cells are last in both directions. */
function inOrder(a, b, down) {
  const [one, two] = [plain(a), plain(b)];
  if (!one || !two) return one ? -1 : two ? 1 : 0;
  const [m, n] = [Number(one), Number(two)], [isNumber, isToo] = [!Number.isNaN(m), !Number.isNaN(n)];
  const found = isNumber && isToo ? m - n : isNumber !== isToo ? (isNumber ? -1 : 1)
    : one.localeCompare(two, undefined, { numeric: true });
  return down ? -found : found;
}
DataTable.type("exact", "order", { asc: (a, b) => inOrder(a, b, false), desc: (a, b) => inOrder(a, b, true) });
DataTable.type("exact", "search", plain);

const TABLE_WORDS = {
  info: "_START_ to _END_ of _TOTAL_", infoEmpty: "no row", infoFiltered: "(_MAX_ without the filter)",
  emptyTable: "no row", zeroRecords: "no row", thousands: ",",
};

/** A DataTable without controls of its own but for its pages. */
function dataTable(table, rows, options) {
  const paged = rows > (options.pageLength ?? PAGED_FROM);
  const api = new DataTable(table, {
    autoWidth: false, order: [], language: TABLE_WORDS, paging: paged, pageLength: ROWS_OF_A_PAGE,
    layout: { topStart: null, topEnd: null, bottomStart: paged ? "info" : null, bottomEnd: paged ? "paging" : null },
    ...options,
    columnDefs: [...(options.columnDefs ?? []), { type: "exact", targets: "_all" }],
  });
  api.table().container().querySelector("nav")?.setAttribute("aria-label", `Pages of ${table.id || "the table"}`);
  return api;
}

/** Move the region that scrolls from around a table to the part of the DataTable that is as wide as its cells. */
function scrolling(table, region) {
  const inner = table.closest(".dt-layout-table");
  inner.classList.add("scroll");
  for (const name of ["role", "aria-label", "tabindex"]) inner.setAttribute(name, region.getAttribute(name));
  region.className = "holds-table";
  for (const name of ["role", "aria-label", "tabindex"]) region.removeAttribute(name);
}

/** The text of a cell in the CSV file; `isData`: of a table that is one of the run folder's files. */
function exactOf(cell, isData) {
  return cell.dataset.order ?? (isData ? cell.textContent : cell.textContent.trim().replace(/\s+/g, " "));
}

/** A cell quoted for CSV, as in harness.evaluation.tables. */
function quoted(text) {
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

function csvOf(rows) {
  return rows.map(row => `${row.map(quoted).join(",")}\n`).join("");
}

function download(name, text) {
  const link = make("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A number as the page shows it, with `digits` decimals and a typographic minus. */
function numberText(value, digits) {
  const text = value.toLocaleString("en", { minimumFractionDigits: digits, maximumFractionDigits: digits });
  return /[1-9]/.test(text) ? text.replace("-", "−") : text.replace("-", "");
}

/** A cell of the CSV file as the page shows it (harness.reports.data_table does the same for short tables). */
function shownAs(kind, exact) {
  if (kind === "text") return exact;
  if (exact === "") return "–";
  const value = Number(exact);
  if (kind === "flag") return exact === "true" ? "yes" : "no";
  if (kind === "count") return numberText(value, 0);
  if (kind === "percent") return numberText(value * 100, 1).replace(/\.0$/, "");
  return kind === "number" ? numberText(value, 2) : exact;
}

/** The rows of a long table, [rows][columns] as in the CSV file: columns as JSON, deflated. */
async function unpackedRows(table) {
  const bytes = await inflated(document.querySelector(`script[data-rows-of="${table.id}"]`).textContent);
  const columns = JSON.parse(new TextDecoder().decode(bytes));
  return columns[0].map((_, row) => columns.map(column => column[row]));
}

/** What DataTables needs for a long table: rows as arrays of exact texts, shown by the kind of their column. */
function packedOptions(columns, kinds, rows) {
  const keyOfRow = keyOfRows(columns);
  const definition = (kind, place) => ({
    targets: place, className: kind === "text" ? "text" : "", cellType: place ? "td" : "th",
    render: (exact, type, row) => {
      if (type !== "display") return exact;
      const text = shownAs(kind, exact).replaceAll("&", "&amp;").replaceAll("<", "&lt;");
      const key = place === 0 && keyOfRow(row);
      return key && games.has(key) ? `<a href="#game=${key}">${text}</a>` : text;
    },
  });
  return {
    data: rows, columnDefs: kinds.map(definition),
    createdRow: row => row.cells[0].setAttribute("scope", "row"),
  };
}

/** A function that gives the key of the game of a row; null for a table that is not of games. */
function keyOfRows(columns) {
  const [arm, seed, episode] = ["arm", "seed", "episode"].map(name => columns.indexOf(name));
  return row => (episode < 0 ? null : keyOf({ arm: row[arm], seed: row[seed], episode: row[episode] }));
}

/** Filters of the table of games: lists of arms and outcomes, and a field for text. */
function filters(bar, api, columns, values) {
  const count = make("output");
  const apply = () => {
    api.draw();
    const { recordsDisplay, recordsTotal } = api.page.info();
    count.textContent = `${recordsDisplay} of ${recordsTotal} games`;
  };
  for (const name of columns.filter(each => /^(arm|ego_outcome|non_ego(_\d)?_outcome)$/.test(each))) {
    const column = api.column(columns.indexOf(name)), found = values(columns.indexOf(name));
    if (found.length < 2 || found.length > MOST_CHOICES) continue;
    const select = make("select", {}, make("option", { value: "-1", text: "all" }),
      ...found.map((value, n) => make("option", { value: n, text: value || "–" })));
    select.dataset.filter = name;
    select.addEventListener("change", () => {
      column.search.fixed("chosen", select.value === "-1" ? null : text => plain(text) === found[select.value]);
      apply();
    });
    bar.append(make("label", { text: `${name.replace("non_ego", "non-ego").replaceAll("_", " ")} ` }, select));
  }
  const search = make("input", { type: "search", size: "14", "data-filter": "text" });
  search.addEventListener("input", () => { api.search(search.value); apply(); });
  bar.append(make("label", { text: "text " }, search), count);
  apply();
}

/** Add download, sorting, pages and filters to a table. */
async function equip(table) {
  const region = table.closest(".scroll"), isLong = table.matches("[data-packed]");
  const isData = table.matches(".data");
  const headings = [...table.tHead.rows[0].cells];
  const heading = headings.map(cell => cell.dataset.column ?? exactOf(cell, isData));
  const name = `${table.id || table.caption.textContent.trim().toLowerCase().replace(/[^a-z0-9]+/g, "_")}.csv`;
  const rows = isLong ? await unpackedRows(table) : [...table.tBodies[0].rows];
  const options = isLong ? packedOptions(heading, headings.map(cell => cell.dataset.kind), rows) : {};
  const api = dataTable(table, rows.length, options);
  scrolling(table, region);
  const exact = isLong ? row => row : row => [...row.cells].map(cell => exactOf(cell, isData));
  const save = make("button", { type: "button", text: "Download CSV" });
  save.addEventListener("click", () => {
    const places = api.rows({ search: "applied", order: "index" }).indexes().toArray();
    download(name, csvOf([heading, ...places.map(place => exact(rows[place]))]));
  });
  const bar = make("div", { class: "filters" });
  if (table.id === "episodes") {
    filters(bar, api, heading, place => [...new Set(rows.map(row => exact(row)[place]))]);
  }
  bar.append(save);
  region.before(bar);
  table.dataset.ready = "";
}

/** Equip the tables of a part of the page that are not folded away. */
function equipVisible() {
  for (const table of document.querySelectorAll(".scroll > table:not(.dataTable, #failure-table)")) {
    if (table.closest("details:not([open])") || "begun" in table.dataset) continue;
    table.dataset.begun = "";
    equip(table);
  }
}
document.addEventListener("toggle", equipVisible, true); // toggle events do not bubble
equipVisible();
