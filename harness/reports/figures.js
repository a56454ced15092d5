// Links of figures: each names its game, for pointers (a tooltip) and for screen readers. Of a figure with many, the tab
// key passes them by: tables have them.

const MOST_STOPS = 12;

requestAnimationFrame(() => {
  for (const link of document.querySelectorAll('svg a[href^="#game="]')) {
    const game = games.get(normal(link.getAttribute("href").slice("#game=".length)));
    const words = game ? `${titleOf(game)}: ${OUTCOMES[game.outcome] ?? game.outcome}` : "in the run folder: harness serve shows it";
    if (game) link.setAttribute("aria-label", words);
    else link.removeAttribute("href"); // the page has no room for it
    if (link.ownerSVGElement.querySelectorAll("a").length > MOST_STOPS) link.tabIndex = -1;
    const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
    title.textContent = words;
    link.prepend(title);
  }
});
