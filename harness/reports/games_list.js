// The list of games of the player: sorted and filtered; "previous" and "next" go through it as it is shown.

const SHOWN_GAMES = 8;

class GamesList {
  /** The list in a table of the page; `choose` is called with the key of a game that is clicked. */
  constructor(root, choose) {
    this.table = root.querySelector(".games-list table");
    this.filter = root.querySelector('[data-is="outcome"]');
    this.search = root.querySelector('[data-is="search"]');
    this.place = root.querySelector('[data-is="place"]');
    this.choose = choose;
    this.arm = null;
    this.key = null;
  }

  /** Make the table, which takes a while for thousands of games. */
  fill() {
    if (this.api) return;
    const worstFirst = [...games].sort(([, a], [, b]) => b.severity - a.severity
      || (a.leastTime ?? Infinity) - (b.leastTime ?? Infinity) || 0);
    const rows = worstFirst.map(([key, game]) => ({
      key, arm: game.arm, game: `${game.episode}`, seed: game.seed, outcome: OUTCOMES[game.outcome] ?? game.outcome,
      time: game.leastTime ?? "", deltaV: game.deltaV ?? "",
      cause: game.cause + (game.reference ? `${game.cause && "; "}prevented by the ${game.reference.driver}` : ""),
    }));
    const shown = digits => (value, type) => (type !== "display" ? value : value === "" ? "–" : value.toFixed(digits));
    const opens = (text, type, row) => (type === "display" ? `<a href="#game=${row.key}">${text}</a>` : text);
    this.api = dataTable(this.table, rows.length, {
      data: rows, pageLength: SHOWN_GAMES,
      layout: { topStart: null, topEnd: null, bottomStart: "info", bottomEnd: "paging" }, paging: true,
      columns: [
        { data: "game", render: opens, cellType: "th", title: "game" }, { data: "seed", title: "seed", visible: severalSeeds },
        { data: "outcome", className: "text", title: "outcome", render: DataTable.render.text() },
        { data: "deltaV", title: "delta-v (m/s)", render: shown(1) },
        { data: "time", title: "least TTC (s)", render: shown(2) },
        { data: "cause", className: "text", title: "why", render: DataTable.render.text() },
        { data: "arm", visible: false, render: DataTable.render.text() },
      ],
      createdRow: (row, { key }) => {
        row.cells[0].setAttribute("scope", "row");
        row.dataset.key = key;
      },
    });
    this.api.column(6).search.fixed("arm", arm => this.arm === null || arm === this.arm);
    this.api.on("draw", () => this.mark());
    const outcomes = [...new Set(rows.map(row => row.outcome))];
    this.filter.append(...outcomes.map(outcome => make("option", { value: outcome, text: outcome })));
    this.filter.addEventListener("change", () => {
      const wanted = this.filter.value;
      this.api.column(2).search.fixed("outcome", outcome => !wanted || outcome === wanted).draw();
    });
    this.search.addEventListener("input", () => this.api.search(this.search.value).draw());
    this.table.addEventListener("click", event => {
      const link = event.target.closest("a");
      if (!link || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      this.choose(event.target.closest("tr").dataset.key);
    });
    this.api.draw();
    this.show(this.key);
  }

  /** The keys in the order that is shown. */
  order() {
    if (!this.api) this.fill();
    return this.api.rows({ order: "applied", search: "applied" }).data().toArray().map(row => row.key);
  }

  /** Show the games of an arm; null: of every arm. */
  ofArm(arm) {
    if (arm === this.arm) return;
    this.arm = arm;
    this.api?.draw();
  }

  /** Mark the game that is open, and turn to its page. */
  show(key) {
    this.key = key;
    if (!this.api) return;
    const order = this.order(), place = order.indexOf(key);
    this.place.textContent = place < 0 ? `not among the ${order.length} listed` : `${place + 1} of ${order.length}`;
    if (place >= 0) this.api.page(Math.floor(place / SHOWN_GAMES));
    this.api.draw("page");
  }

  mark() {
    for (const row of this.table.tBodies[0].rows) row.toggleAttribute("aria-current", row.dataset.key === this.key);
  }

  /** The key that is so many games further down the list; undefined at its ends. */
  beside(count) {
    const order = this.order(), place = order.indexOf(this.key);
    return order[place < 0 ? 0 : place + count];
  }
}
