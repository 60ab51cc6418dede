// Blocks of ```math become formulas where MathJax could be loaded, and stay readable text where not.
window.addEventListener("load", () => {
    if (!window.MathJax || !window.MathJax.Hub) {
        return;
    }
    for (const code of document.querySelectorAll("pre > code.language-math")) {
        const formula = document.createElement("div");
        formula.textContent = "\\[" + code.textContent + "\\]";
        const block = code.closest("pre");
        block.replaceWith(formula);
        window.MathJax.Hub.Queue(["Typeset", window.MathJax.Hub, formula]);
    }
});
