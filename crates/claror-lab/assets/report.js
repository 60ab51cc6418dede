"use strict";
// Theme, copying, sorting. The page is whole without it.
(() => {
  const root = document.documentElement;
  const themes = ["system", "light", "dark"];
  const button = document.getElementById("theme");
  // A page from a file may have no storage.
  const stored = () => { try { return localStorage.getItem("claror-theme"); } catch { return null; } };
  const store = (theme) => { try { localStorage.setItem("claror-theme", theme); } catch { /* only not kept */ } };

  function setTheme(theme) {
    if (theme === "system") delete root.dataset.theme; else root.dataset.theme = theme;
    button.textContent = `Theme: ${theme}`;
    document.dispatchEvent(new Event("themechange"));
  }
  let theme = themes.includes(stored()) ? stored() : "system";
  button.hidden = false;
  button.addEventListener("click", () => {
    theme = themes[(themes.indexOf(theme) + 1) % themes.length];
    store(theme);
    setTheme(theme);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setTheme(theme));
  setTheme(theme);

  /** Copies by the clipboard, or, where a page may not use it, by a selection. */
  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
  }
  for (const one of document.querySelectorAll("button.copy")) {
    one.hidden = false;
    const text = one.textContent;
    one.addEventListener("click", async () => {
      await copy(one.dataset.copy);
      one.focus();
      one.textContent = "Copied";
      setTimeout(() => { one.textContent = text; }, 1500);
    });
  }

  /** Rows without a value stay last in both directions. */
  function sort(table, column, ascending, kind) {
    const body = table.tBodies[0];
    const value = (row) => row.cells[column].dataset.value;
    const compare = (a, b) => kind === "number" ? Number(a) - Number(b) : a.localeCompare(b, "en", { numeric: true });
    const rows = [...body.rows].sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === undefined || y === undefined) return (x === undefined) - (y === undefined);
      return ascending ? compare(x, y) : compare(y, x);
    });
    body.append(...rows);
  }
  for (const table of document.querySelectorAll("table.sortable")) {
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = head.textContent;
      head.replaceChildren(button);
      button.addEventListener("click", () => {
        const ascending = head.getAttribute("aria-sort") !== "ascending";
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", ascending ? "ascending" : "descending");
        sort(table, column, ascending, head.dataset.kind);
      });
    });
  }
})();
