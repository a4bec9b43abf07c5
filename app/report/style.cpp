#include "app/report/style.hpp"

namespace vergence::app::report {
namespace {

constexpr const char* kRules = R"(
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);font:15px/1.45 system-ui,"DejaVu Sans","Segoe UI",Roboto,sans-serif}
main{max-width:1120px;margin:0 auto;padding:14px}
h1{font-size:1.02rem;margin:0 0 2px;overflow-wrap:anywhere}
h2{font-size:1.02rem;margin:0 0 8px}
h3{font-size:.93rem;margin:0 0 4px;font-weight:600}
p{margin:0 0 8px}
.soft{color:var(--soft);font-size:.87rem}
.grid{display:grid;grid-template-columns:1fr;gap:12px;margin-top:12px}
section{background:var(--panel);border-radius:8px;padding:12px;min-width:0}
.wide{grid-column:1/-1}
.assessment{border-left:10px solid var(--tone);margin-top:8px}
.assessment .word{font-size:1.75rem;font-weight:700;color:var(--tone);line-height:1.2;margin:0 0 2px}
.assessment p{font-size:1.02rem}
.tone-good{--tone:var(--good)}.tone-care{--tone:var(--care)}.tone-bad{--tone:var(--bad)}
.numbers{display:grid;grid-template-columns:repeat(auto-fit,minmax(190px,1fr));gap:10px;margin-top:10px}
.number b{display:block;font-size:1.5rem;line-height:1.25;font-variant-numeric:tabular-nums}
.number span{display:block}
ul{margin:0;padding-left:1.2em}
li{margin-bottom:3px;overflow-wrap:anywhere}
figure{margin:0}
svg{display:block;width:100%;height:auto}
svg text{font-size:13px;fill:var(--soft);font-family:inherit;font-variant-numeric:tabular-nums}
svg text.strong{fill:var(--ink)}
svg text.good{fill:var(--good);paint-order:stroke;stroke:var(--panel);stroke-width:3px}
svg text.cell{fill:var(--ink)}
path,line,polyline{fill:none}
.axis{stroke:var(--frame);stroke-width:1}
.tick{stroke:var(--frame);stroke-width:1;opacity:.28}
.curve{stroke-width:1.6;stroke-linecap:round;stroke-linejoin:round}
.s-ours{stroke:var(--ours)}.s-theirs{stroke:var(--theirs)}.s-third{stroke:var(--third)}.s-bad{stroke:var(--bad)}.s-ink{stroke:var(--ink)}.s-care{stroke:var(--care)}
.map-ours{stroke-width:2.2}
.map-theirs{stroke-width:3.4;stroke-dasharray:11 6;stroke-linecap:butt}
.map-care{stroke-width:4.4;stroke-dasharray:3 4;stroke-linecap:butt}
.f-ours{fill:var(--ours)}.f-theirs{fill:var(--theirs)}.f-good{fill:var(--good)}.f-care{fill:var(--care)}.f-bad{fill:var(--bad)}
.f-third{fill:var(--third)}.f-fourth{fill:var(--fourth)}.f-soft{fill:var(--soft)}.f-ink{fill:var(--ink)}
.o1{opacity:.12}.o2{opacity:.22}.o3{opacity:.32}.o4{opacity:.42}.o5{opacity:.54}
.sheet{fill:none;stroke:var(--frame);stroke-width:1;opacity:.5}
.hollow{fill:var(--panel);stroke:var(--bad);stroke-width:1.6}
.seen{fill:var(--panel);stroke:var(--soft);stroke-width:1.4}
.whisker{stroke:var(--soft);stroke-width:1.2}
.confirmed{stroke:var(--good);stroke-width:1.4;stroke-dasharray:3 3}
.band{fill:var(--ours);opacity:.2;stroke:none}
.hole{fill:var(--bad);opacity:.14}
.track{fill:var(--frame);opacity:.16}
.budget{stroke:var(--bad);stroke-width:1.6;stroke-dasharray:6 4}
.key{display:inline-block;width:1.5em;height:.34em;border-radius:2px;vertical-align:middle;margin:0 .35em 0 0}
.k-ours{background:var(--ours)}
.k-theirs{background:repeating-linear-gradient(90deg,var(--theirs) 0 7px,transparent 7px 11px)}
.k-care{background:repeating-linear-gradient(90deg,var(--care) 0 3px,transparent 3px 6px)}
.legend span{margin-right:1.1em;white-space:nowrap}
table{border-collapse:collapse;width:100%;font-size:.9rem}
th,td{text-align:left;padding:3px 8px 3px 0;vertical-align:top;border-bottom:1px solid color-mix(in srgb,var(--frame) 30%,transparent);overflow-wrap:anywhere}
th{font-weight:400;color:var(--soft)}
th[scope=row]{min-width:8.5em}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;padding-right:0}
td.k{min-width:6.4em}
td.w,span.w{white-space:nowrap}
.clocks td.n,.clocks th.n{padding-left:10px;overflow-wrap:normal}
.clocks td.n{white-space:nowrap}
.clocks{margin-bottom:8px}
.clocks th[scope=row]{min-width:4.5em}
.health{max-width:640px;margin-bottom:4px}
.health td.n,.health th.n{white-space:nowrap;overflow-wrap:normal;padding-left:8px}
.scroll{overflow-x:auto}
td.t{white-space:nowrap;font-variant-numeric:tabular-nums}
tr.group th{color:var(--ink);font-weight:600;padding-top:9px}
@media screen and (max-width:560px){
.health{font-size:.8rem}
.health th[scope=row],.health td.k{min-width:0}
.health td.n,.health th.n{padding-left:5px}
.stack tr{display:block;border-bottom:1px solid color-mix(in srgb,var(--frame) 30%,transparent);padding:3px 0}
.stack tr:first-child{display:none}
.stack td{display:inline;border:0;padding:0 .7em 0 0}
.stack td:last-child{display:block}
}
@media (min-width:860px){.grid{grid-template-columns:1fr 1fr}.tall{grid-row:span 2}.two{columns:2;column-gap:24px}}
@page{size:A4;margin:12mm}
@media print{
body{font-size:10pt;background:#fff}main{max-width:none;padding:0}
.grid{grid-template-columns:1fr 1fr;gap:6px}.tall{grid-row:span 2}.two{columns:2}
section{border:1px solid var(--frame);padding:8px;break-inside:avoid;border-radius:4px}
.assessment{border-left:10px solid var(--tone)}
section.long{break-inside:auto}
.band,.hole,.track,.key,rect,circle{print-color-adjust:exact;-webkit-print-color-adjust:exact}
}
)";

std::string variables(bool dark) {
  std::string css;
  const auto add = [&](const Colour& c) {
    css += std::string("--") + c.name + ":" + (dark ? c.dark : c.light) + ";";
  };
  add(kPage);
  add(kPanel);
  for (const Colour& c : kColours) add(c);
  return css;
}

}  // namespace

std::string palette() {
  // Paper is light whatever the screen's theme.
  return ":root{color-scheme:light dark;" + variables(false) +
         "}\n@media screen and (prefers-color-scheme:dark){:root{" + variables(true) + "}}";
}

std::string style_sheet() { return palette() + kRules; }

}  // namespace vergence::app::report
