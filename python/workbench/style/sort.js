  // Sorts a table by the column of a heading; a second click turns the order round.
  function ehsidSort(button) {
    const head = button.closest("th"), root = head.getRootNode();
    const down = head.getAttribute("aria-sort") === "ascending";
    root.ehsidOrder = {column: head.cellIndex, down};
    ehsidOrderRows(root);
    if (!root.ehsidWatch) {  // a table that is shown anew keeps the order
      root.ehsidWatch = new MutationObserver(() => {
        if (root.querySelector("table:not([data-ordered])")) ehsidOrderRows(root);
      });
      root.ehsidWatch.observe(root, {childList: true, subtree: true});
    }
  }
  function ehsidOrderRows(root) {
    const table = root.querySelector("table"), {column, down} = root.ehsidOrder;
    table.dataset.ordered = "";
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((one) => one.removeAttribute("aria-sort"));
    heads[column].setAttribute("aria-sort", down ? "descending" : "ascending");
    const key = (row) => row.cells[column].dataset.key;
    const order = (a, b) => {
      // What is not known stands last in both orders.
      if (key(a) === "" || key(b) === "") return (key(a) === "") - (key(b) === "");
      const sign = down ? -1 : 1;
      const numbers = heads[column].classList.contains("n");
      return sign * (numbers ? Number(key(a)) - Number(key(b)) : key(a).localeCompare(key(b)));
    };
    [...table.tBodies[0].rows].sort(order).forEach((row) => table.tBodies[0].append(row));
  }
