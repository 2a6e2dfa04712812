// The table of grasps: sortable by any column, a row is picked by click, touch or key.
import type { Description, GraspDescription } from "./format";

interface Heading {
  label: string;
  unit: string;
  about: string;
  digits: number;
  value: (grasp: GraspDescription) => number | null;
}

export class GraspTable {
  /** Places in `description.grasps`, as the rows stand. */
  order: number[];
  sortedBy = 0;
  ascending = true;
  private readonly headings: Heading[];
  private readonly rows: HTMLTableRowElement[] = [];
  private readonly headers: HTMLTableCellElement[] = [];
  private readonly body = document.createElement("tbody");

  constructor(table: HTMLTableElement, private readonly description: Description, pick: (grasp: number) => void) {
    this.headings = [
      { label: "rank", unit: "", about: "1 is the grasp with the least simulation displacement", digits: 0, value: (g) => g.rank },
      { label: "start", unit: "", about: "number of the start that the grasp was optimised from", digits: 0, value: (g) => g.index },
      ...description.columns.map((column, at) => ({ ...column, value: (g: GraspDescription) => g.metrics[at] })),
    ];
    this.order = description.grasps.map((_, i) => i);
    const head = table.createTHead().insertRow();
    this.headings.forEach((heading, at) => {
      const cell = document.createElement("th");
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = heading.label;
      button.title = heading.about;
      if (heading.unit) {
        const unit = document.createElement("small");
        unit.textContent = heading.unit;
        button.append(unit);
      }
      button.addEventListener("click", () => this.sort(at, this.sortedBy === at ? !this.ascending : true));
      cell.append(button);
      cell.scope = "col";
      head.append(cell);
      this.headers.push(cell);
    });
    description.grasps.forEach((grasp, i) => {
      const row = document.createElement("tr");
      row.dataset.index = String(grasp.index);
      for (const heading of this.headings) {
        const value = heading.value(grasp);
        row.insertCell().textContent = value === null ? "–" : value.toFixed(heading.digits);
      }
      row.addEventListener("click", () => pick(i));
      this.rows.push(row);
    });
    table.append(this.body);
    this.sort(0, true);
  }

  sort(column: number, ascending: boolean): void {
    this.sortedBy = column;
    this.ascending = ascending;
    const value = this.headings[column].value;
    const grasps = this.description.grasps;
    // Values that are missing come last either way; equal ones keep the order of the run.
    this.order.sort((a, b) => {
      const [x, y] = [value(grasps[a]), value(grasps[b])];
      if (x === null || y === null) return x === y ? a - b : x === null ? 1 : -1;
      return (ascending ? x - y : y - x) || a - b;
    });
    this.headers.forEach((cell, at) => {
      if (at === column) cell.setAttribute("aria-sort", ascending ? "ascending" : "descending");
      else cell.removeAttribute("aria-sort");
    });
    this.body.append(...this.order.map((i) => this.rows[i]));
  }

  select(grasp: number, scroll: boolean): void {
    this.rows.forEach((row, i) => {
      if (i === grasp) row.setAttribute("aria-selected", "true");
      else row.removeAttribute("aria-selected");
    });
    if (scroll) this.reveal(this.rows[grasp]);
  }

  /** Scrolls the table's own box, and never the page, which would take the grasp out of view. */
  private reveal(row: HTMLTableRowElement): void {
    const box = this.body.closest("table")?.parentElement;
    if (!box) return;
    const head = this.headers[0].offsetHeight;
    const above = row.offsetTop - head - box.scrollTop;
    const below = row.offsetTop + row.offsetHeight - box.clientHeight - box.scrollTop;
    if (above < 0) box.scrollTop += above;
    else if (below > 0) box.scrollTop += below;
  }

  /** The grasp `by` rows below another. */
  neighbour(grasp: number, by: number): number {
    const place = this.order.indexOf(grasp) + by;
    return this.order[Math.min(this.order.length - 1, Math.max(0, place))];
  }
}
