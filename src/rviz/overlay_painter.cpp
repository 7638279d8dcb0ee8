#include "rviz/overlay_painter.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <QFont>
#include <QFontMetricsF>
#include <QPainter>
#include <QPolygonF>
#include <QString>

#include "train_derail/scene/marks.hpp"

namespace train_derail::rviz_panel {

namespace {

using scene::Look;

const QColor kPlate(16, 20, 26, 208);
const QColor kText(255, 255, 255);
const QColor kQuiet(200, 206, 214);

constexpr double kTextLeast = 13.0;       // on a common screen [pixels]
constexpr double kTextsInPicture = 48.0;  // this many lines fill a picture
constexpr double kSmallest = 8.0;         // a legend's text never gets smaller [pixels]
/// In heights of the text
constexpr double kLine = 1.35, kPad = 0.45, kGap = 1.1, kIcon = 2.3, kIconGap = 0.4;

QFont font_of(double text, bool bold) {
  QFont font("sans-serif");
  font.setStyleHint(QFont::SansSerif);
  font.setPixelSize(std::max(1, static_cast<int>(std::lround(text))));
  font.setBold(bold);
  return font;
}

QString to_qt(const std::string& text) { return QString::fromStdString(text); }
QString to_qt(std::string_view text) { return QString::fromUtf8(text.data(), static_cast<int>(text.size())); }
QColor to_qt(const scene::Rgb& c) { return {c.r, c.g, c.b}; }

double width_of(const QString& text, const QFont& font) { return QFontMetricsF(font).horizontalAdvance(text); }

/// A plate and a painter on it.
class Plate {
 public:
  Plate(double width, double height, double text)
      : image_(static_cast<int>(std::ceil(width)), static_cast<int>(std::ceil(height)),
               QImage::Format_ARGB32_Premultiplied) {
    image_.fill(Qt::transparent);
    painter_.begin(&image_);
    painter_.setRenderHint(QPainter::Antialiasing);
    painter_.setPen(Qt::NoPen);
    painter_.setBrush(kPlate);
    painter_.drawRoundedRect(image_.rect(), 0.35 * text, 0.35 * text);
  }
  QPainter& painter() { return painter_; }
  void write(double x, double y, double height, const QString& text, const QFont& font, const QColor& colour = kText) {
    painter_.setFont(font);
    painter_.setPen(colour);
    painter_.drawText(QRectF(x, y, width_of(text, font) + font.pixelSize(), height), Qt::AlignLeft | Qt::AlignVCenter,
                      text);
  }
  QImage take() {
    painter_.end();
    return std::move(image_);
  }

 private:
  QImage image_;
  QPainter painter_;
};

/// A thing of a legend, drawn into a box.
using Icon = std::function<void(QPainter&, const QRectF&)>;

struct Item {
  Icon icon;
  QString words;
};

/// A car from above with the bars across its roof.
void draw_car(QPainter& p, const QRectF& box, const scene::LookFacts& facts) {
  p.setPen(QPen(kText, std::max(1.0, 0.06 * box.height())));
  p.setBrush(to_qt(facts.colour));
  p.drawRect(box);
  p.setPen(Qt::NoPen);
  p.setBrush(QColor(0, 0, 0));
  const double bar = 0.07 * box.width();
  for (int i = 0; i < facts.bars; ++i) {
    const double x = box.center().x() + (i - 0.5 * (facts.bars - 1)) * 2.6 * bar;
    p.drawRect(QRectF(x - 0.5 * bar, box.top(), bar, box.height()));
  }
}

/// The two ends, apart.
void draw_broken(QPainter& p, const QRectF& box) {
  for (const auto& [colour, width] : {std::pair(kText, 0.46), std::pair(to_qt(scene::kBrokenColour), 0.24)}) {
    p.setPen(QPen(colour, width * box.height(), Qt::SolidLine, Qt::SquareCap));
    for (const double side : {-1.0, 1.0}) {
      const double tip = box.center().x() + side * 0.16 * box.width(), tail = tip + side * 0.24 * box.width();
      p.drawLine(QPointF(tip, box.center().y()), QPointF(tail, box.center().y()));
      p.drawLine(QPointF(tip, box.top() + 0.2 * box.height()), QPointF(tip, box.bottom() - 0.2 * box.height()));
    }
  }
}

void draw_star(QPainter& p, const QRectF& box) {
  QPolygonF star;
  for (int i = 0; i < 2 * scene::kStarRays; ++i) {
    const double r = (i % 2 == 0 ? 0.5 : 0.5 * scene::kStarInner) * box.height(), a = M_PI * i / scene::kStarRays;
    star << box.center() + QPointF(r * std::cos(a), r * std::sin(a));
  }
  p.setPen(Qt::NoPen);
  p.setBrush(to_qt(scene::kStarRim));
  p.drawPolygon(star);
}

/// A needle that points to the angle `turn` against x, to the left [rad].
void draw_north(QPainter& p, const QPointF& middle, double length, double turn) {
  const QPointF ahead(length * std::cos(turn), -length * std::sin(turn)), aside(0.38 * ahead.y(), -0.38 * ahead.x());
  p.setPen(QPen(kText, std::max(1.0, 0.07 * length)));
  p.setBrush(Qt::NoBrush);
  p.drawPolygon(QPolygonF() << middle - ahead << middle + aside << middle - aside);
  p.setBrush(kText);
  p.drawPolygon(QPolygonF() << middle + ahead << middle + aside << middle - aside);
}

/// Two arrows: away from each other in draft, towards each other in buff.
void draw_arrows(QPainter& p, const QRectF& box, bool buff) {
  p.setPen(QPen(kText, std::max(1.0, 0.05 * box.height())));
  p.setBrush(to_qt(scene::force_colour(buff ? 4 : -4)));
  for (const double side : {-1.0, 1.0}) {
    const double inner = box.center().x() + side * 0.06 * box.width(), outer = inner + side * 0.36 * box.width();
    const double tip = buff ? inner : outer, tail = buff ? outer : inner;
    p.drawPolygon(QPolygonF() << QPointF(tip, box.center().y()) << QPointF(tail, box.top())
                              << QPointF(tail, box.bottom()));
  }
}

/// Things one after the other in lines of a given width.
class Flow {
 public:
  Flow(const std::vector<Item>& items, double most, double text) : text_(text), font_(font_of(text, false)) {
    double x = 0.0;
    int line = 0;
    for (const Item& item : items) {
      const double w = (kIcon + kIconGap) * text + width_of(item.words, font_);
      if (x > 0.0 && x + w > most) {
        x = 0.0;
        ++line;
      }
      places_.push_back({&item, x, line});
      width_ = std::max(width_, x + w);
      x += w + kGap * text;
    }
    lines_ = places_.empty() ? 0 : line + 1;
  }
  double width() const { return width_; }
  double height() const { return lines_ * kLine * text_; }
  void draw(Plate& plate, double x, double y) const {
    for (const Place& place : places_) {
      const double top = y + place.line * kLine * text_;
      place.item->icon(plate.painter(), {x + place.x, top + 0.26 * text_, kIcon * text_, (kLine - 0.52) * text_});
      plate.write(x + place.x + (kIcon + kIconGap) * text_, top, kLine * text_, place.item->words, font_);
    }
  }

 private:
  struct Place {
    const Item* item;
    double x;
    int line;
  };
  double text_;
  QFont font_;
  std::vector<Place> places_;
  double width_ = 0.0;
  int lines_ = 0;
};

/// The classes of forces that are in use, and those between them, as boxes with their limits below.
class ForceBoxes {
 public:
  ForceBoxes(const Entries& entries, double text) : text_(text), font_(font_of(0.92 * text, false)) {
    for (int k = -scene::kForceClasses; k <= scene::kForceClasses; ++k) {
      if (!entries.has_force(k)) continue;
      if (!any_) first_ = k;
      last_ = k;
      any_ = true;
    }
    box_ = 0.6 * text + width_of("8888", font_);
  }
  bool any() const { return any_; }
  double width() const {
    if (!any_) return 0.0;
    // The outermost limits reach half their width beyond the boxes, their unit stands behind them.
    return (last_ - first_ + 2) * box_ + width_of("kip", font_);
  }
  double height() const { return any_ ? (0.95 + 2.0 * 1.15) * text_ : 0.0; }
  void draw(Plate& plate, double x, double y) const {
    const double left = x + 0.5 * box_, high = 0.8 * text_;
    QPainter& p = plate.painter();
    const double kip = y + 0.95 * text_, kn = kip + 1.15 * text_;
    for (int k = first_; k <= last_; ++k) {
      p.setPen(QPen(QColor(90, 96, 104), std::max(1.0, 0.06 * text_)));
      p.setBrush(to_qt(scene::force_colour(k)));
      p.drawRect(QRectF(left + (k - first_) * box_, y, box_, high));
    }
    // Between two classes: that of the one farther from none. The last class has no end.
    for (int edge = first_; edge <= last_ + 1; ++edge) {
      const int k = edge > 0 ? edge - 1 : -edge;
      if (k >= scene::kForceClasses) continue;
      const auto limit = force_limit(k);
      const double middle = left + (edge - first_) * box_;
      for (const auto& [words, line] : {std::pair(limit.first, kip), std::pair(limit.second, kn)}) {
        const QString number = to_qt(words);
        plate.write(middle - 0.5 * width_of(number, font_), line, 1.15 * text_, number, font_);
      }
    }
    const double units = left + (last_ - first_ + 1.5) * box_ + 0.3 * text_;
    plate.write(units, kip, 1.15 * text_, "kip", font_, kQuiet);
    plate.write(units, kn, 1.15 * text_, "kN", font_, kQuiet);
  }
  bool draft() const { return any_ && first_ < 0; }
  bool buff() const { return any_ && last_ > 0; }

 private:
  double text_, box_ = 0.0;
  QFont font_;
  bool any_ = false;
  int first_ = 0, last_ = 0;
};

}  // namespace

double text_height(int picture_height, double pixel_ratio) {
  return std::max(kTextLeast * pixel_ratio, picture_height / kTextsInPicture);
}

QImage paint_strip(const Strip& strip, const Space& space) {
  if (strip.run.empty()) return {};
  const double line = kLine * space.text, pad = kPad * space.text;
  const double inside = space.width - 2.0 * pad;
  const int lines_most = std::max(1, static_cast<int>((space.height - 2.0 * pad) / line));
  const QFont plain = font_of(space.text, false), bold = font_of(space.text, true);

  struct Place {
    const Statement* statement;
    double x;
    int line;
  };
  std::vector<Place> places;
  double x = 0.0;
  int row = 1;
  for (const Statement& s : strip.statements) {
    const double w = width_of(to_qt(s.text), s.strong ? bold : plain);
    if (x > 0.0 && x + w > inside) {
      x = 0.0;
      ++row;
    }
    if (row >= lines_most) break;
    places.push_back({&s, x, row});
    x += w + 1.6 * space.text;
  }
  const int lines = places.empty() ? 1 : places.back().line + 1;

  Plate plate(space.width, std::min<double>(space.height, lines * line + 2.0 * pad), space.text);
  const QString now = to_qt(strip.state.empty() ? strip.run : strip.run + " \u00b7 " + strip.state);
  const double now_width = width_of(now, bold);
  plate.write(pad + inside - now_width, pad, line, now, bold);
  const QString title =
      QFontMetricsF(plain).elidedText(to_qt(strip.title), Qt::ElideRight, inside - now_width - 1.6 * space.text);
  plate.write(pad, pad, line, title, plain, kQuiet);
  for (const Place& place : places) {
    plate.write(pad + place.x, pad + place.line * line, line, to_qt(place.statement->text),
                place.statement->strong ? bold : plain);
  }
  return plate.take();
}

QImage paint_legend(const Entries& entries, const Space& space) {
  if (entries.empty()) return {};
  std::vector<Item> items;
  const auto add_cars = [&items, &entries](auto first, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto kind = static_cast<decltype(first)>(i);
      if (!entries.has(kind)) continue;
      const scene::LookFacts& facts = facts_of(kind);
      items.push_back({[&facts](QPainter& p, const QRectF& box) { draw_car(p, box, facts); }, to_qt(facts.words)});
    }
  };
  add_cars(Look{}, scene::kLooks);
  add_cars(scene::Lie{}, scene::kLies);
  if (entries.has_broken()) items.push_back({draw_broken, "broken coupler"});
  if (entries.has_impact()) items.push_back({draw_star, "cars touch, closing speed"});

  for (double text = space.text;; text *= 0.95) {
    const double pad = kPad * text, inside = space.width - 2.0 * pad;
    const ForceBoxes forces(entries, text);
    std::vector<Item> arrows;
    if (forces.draft()) {
      arrows.push_back({[](QPainter& p, const QRectF& box) { draw_arrows(p, box, false); }, "coupler pulls (draft)"});
    }
    if (forces.buff()) {
      arrows.push_back({[](QPainter& p, const QRectF& box) { draw_arrows(p, box, true); }, "coupler pushes (buff)"});
    }
    const Flow states(items, inside, text), directions(arrows, inside, text);
    const double width = std::max({states.width(), directions.width(), forces.width()}) + 2.0 * pad;
    const double height = states.height() + directions.height() + forces.height() + 2.0 * pad;
    if ((height > space.height || width > space.width) && text > kSmallest) continue;
    Plate plate(std::min<double>(width, space.width), std::min<double>(height, space.height), text);
    states.draw(plate, pad, pad);
    directions.draw(plate, pad, pad + states.height());
    if (forces.any()) forces.draw(plate, pad, pad + states.height() + directions.height());
    return plate.take();
  }
}

QImage paint_map(const TrainMap& map, const Space& space) {
  if (map.cars.empty()) return {};
  const double pad = kPad * space.text, line = kLine * space.text;
  const double inside = space.width - 2.0 * pad, most = space.height - 2.0 * pad - 2.0 * line;
  if (inside <= 0.0 || most <= 0.0) return {};
  // The rectangle and the tick are to be seen even where the train is a line.
  const double least = std::min(most, 1.6 * space.text);
  const double scale = std::min(inside / (map.right - map.left), (most - 0.2 * least) / (map.top - map.bottom));
  const double high = std::min(most, std::max(least, scale * (map.top - map.bottom)));

  Plate plate(space.width, high + 2.0 * line + 2.0 * pad, space.text);
  QPainter& p = plate.painter();
  const QPointF middle(0.5 * space.width, pad + 0.5 * high);
  const double middle_x = 0.5 * (map.left + map.right), middle_y = 0.5 * (map.bottom + map.top);
  const auto at = [&](double x, double y) { return middle + QPointF(scale * (x - middle_x), -scale * (y - middle_y)); };
  const double thin = std::max(1.0, 0.09 * space.text);

  // Whoever derails, or does not stand upright, lies on those that do not.
  for (const bool derailed : {false, true}) {
    for (const MapCar& car : map.cars) {
      if ((car.facts->bars > 0) != derailed) continue;
      const QPointF half(scale * kMapHalfCar * std::cos(car.heading), -scale * kMapHalfCar * std::sin(car.heading));
      p.setPen(QPen(to_qt(car.facts->colour).lighter(115), std::max(0.3 * space.text, 3.2 * scale), Qt::SolidLine,
                    Qt::FlatCap));
      p.drawLine(at(car.x, car.y) - half, at(car.x, car.y) + half);
    }
  }
  const QPointF point = at(map.point_x, map.point_y);
  p.setPen(QPen(kText, 1.5 * thin));
  p.drawLine(point - QPointF(0.0, 0.5 * space.text), point + QPointF(0.0, 0.5 * space.text));
  if (map.heap_length > 0.0) {
    p.save();
    p.translate(at(map.heap_x, map.heap_y));
    p.rotate(-map.heap_turn * 180.0 / M_PI);
    p.setPen(QPen(kText, thin));
    p.setBrush(Qt::NoBrush);
    const double w = std::max(0.9 * space.text, scale * map.heap_length);
    const double h = std::max(0.9 * space.text, scale * map.heap_width + 0.5 * space.text);
    p.drawRect(QRectF(-0.5 * w, -0.5 * h, w, h));
    p.restore();
  }

  const QFont font = font_of(0.92 * space.text, false);
  const double row = pad + high, y = row + 0.5 * line;
  const ScaleBar bar = scale_bar(0.4 * inside / scale);
  p.setPen(QPen(kText, 1.5 * thin));
  p.drawLine(QPointF(pad, y), QPointF(pad + scale * bar.length, y));
  for (const double end : {pad, pad + scale * bar.length}) {
    p.drawLine(QPointF(end, y - 0.25 * space.text), QPointF(end, y + 0.25 * space.text));
  }
  plate.write(pad + scale * bar.length + 0.5 * space.text, row, line, to_qt(bar.text), font);
  // A tick as above, and what it is
  const double tick = row + 1.5 * line;
  p.setPen(QPen(kText, 1.5 * thin));
  p.drawLine(QPointF(pad + thin, tick - 0.5 * space.text), QPointF(pad + thin, tick + 0.5 * space.text));
  plate.write(pad + 0.6 * space.text, row + line, line, "point of derailment", font);
  if (map.north) {
    const QPointF place(space.width - pad - 0.9 * line, row + line);
    draw_north(p, place, 0.85 * line, *map.north);
    plate.write(place.x() - 2.1 * line, row + 0.5 * line, line, "N", font_of(space.text, true));
  }
  return plate.take();
}

}  // namespace train_derail::rviz_panel
