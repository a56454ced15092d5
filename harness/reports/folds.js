// Folded parts of the page: a link into one opens it, and on paper the evidence is unfolded.

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
  if (link) unfoldAddressed(link.getAttribute("href"));  // a link of a figure has no `hash`
});
window.addEventListener("hashchange", () => unfoldAddressed(location.hash));
unfoldAddressed(location.hash);

// On paper the evidence is unfolded, by the style where a browser can do that, and here for the others.
window.addEventListener("beforeprint", () => {
  for (const each of document.querySelectorAll("details.evidence")) each.open = true;
});
