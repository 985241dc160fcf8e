// SPDX-License-Identifier: BSD-3-Clause
#include "plot.h"

#include "page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>

namespace mrf_apps {
namespace {

constexpr double width = 430, height = 300, left = 62, right = 16, top = 36, bottom = 48;

/// Told apart in print and by color-blind eyes; marks differ as well.
constexpr std::array<const char*, 8> colors = {"#1f5fa8", "#c8501e", "#2a8a57", "#8a4aa0",
                                               "#a8842a", "#3f9fb5", "#b03a5b", "#555f68"};

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...)
{
  std::array<char, 400> text;
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  va_end(arguments);
  return text.data();
}

/// One axis: from values to places in the picture.
struct Axis {
  bool isLog = false;
  double lower = 0, upper = 1;
  double begin = 0, end = 1; ///< in the picture

  bool holds(double value) const { return std::isfinite(value) && (!isLog || value > 0); }
  double scaled(double value) const { return isLog ? std::log10(value) : value; }
  double place(double value) const
  {
    const double share = (scaled(value) - scaled(lower)) / (scaled(upper) - scaled(lower));
    return begin + share * (end - begin);
  }
};

/// Covers the values; ends at round numbers where `isRound`.
void fit(Axis& axis, const std::vector<double>& values, bool withZero, bool isRound)
{
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (const double value : values)
    if (axis.holds(value)) {
      lower = std::min(lower, value);
      upper = std::max(upper, value);
    }
  if (!(lower <= upper))
    lower = axis.isLog ? .1 : 0, upper = 1;
  if (axis.isLog) {
    if (upper / lower < 2)
      lower /= 1.5, upper *= 1.5;
    const double margin = std::pow(upper / lower, .03);
    lower /= margin;
    upper *= margin;
  } else {
    if (withZero)
      lower = std::min(lower, 0.), upper = std::max(upper, 0.);
    if (lower == upper)
      lower -= .5, upper += .5;
    if (isRound) {
      const std::vector<Tick> marks = ticks(lower, upper, false, 5);
      const double step = marks.size() > 1 ? marks[1].value - marks[0].value : upper - lower;
      lower = std::floor(lower / step + 1e-9) * step;
      upper = std::ceil(upper / step - 1e-9) * step;
    } else {
      const double margin = .03 * (upper - lower);
      lower -= margin;
      upper += margin;
    }
  }
  axis.lower = lower;
  axis.upper = upper;
}

std::string mark(std::size_t curve, double x, double y)
{
  const char* color = colors[curve % colors.size()];
  switch (curve % 4) {
  case 0:
    return format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.2\" fill=\"%s\"/>", x, y, color);
  case 1:
    return format("<rect x=\"%.1f\" y=\"%.1f\" width=\"5.8\" height=\"5.8\" fill=\"%s\"/>", x - 2.9, y - 2.9, color);
  case 2:
    return format("<path d=\"M%.1f %.1fl3.8 6.4h-7.6z\" fill=\"%s\"/>", x, y - 3.8, color);
  default:
    return format("<path d=\"M%.1f %.1fl4 4l-4 4l-4 -4z\" fill=\"%s\"/>", x, y - 4, color);
  }
}

std::string grid(const Plot& plot, const Axis& x, const Axis& y)
{
  std::string result;
  for (const Tick& tick : ticks(y.lower, y.upper, y.isLog, 5)) {
    const double at = y.place(tick.value);
    result += format("<path d=\"M%.1f %.1fH%.1f\" stroke=\"%s\"/>", x.begin, at, x.end,
                     tick.label.empty() ? "#f2f4f5" : "#dfe4e8");
    result +=
        format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%s</text>", x.begin - 7, at + 4, tick.label.c_str());
  }
  for (const Tick& tick : ticks(x.lower, x.upper, x.isLog, 6)) {
    const double at = x.place(tick.value);
    result += format("<path d=\"M%.1f %.1fv%.1f\" stroke=\"#5d6872\"/>", at, y.begin, tick.label.empty() ? 3. : 5.);
    result +=
        format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>", at, y.begin + 18, tick.label.c_str());
  }
  result +=
      format("<path d=\"M%.1f %.1fV%.1fH%.1f\" fill=\"none\" stroke=\"#5d6872\"/>", x.begin, y.end, y.begin, x.end);
  result += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", .5 * (x.begin + x.end), height - 10) +
            escaped(plot.xLabel) + "</text>";
  // A long label is written smaller rather than cut off at the edges of the picture.
  const double room = height - 8, perCharacter = .54;
  const double size =
      std::min(12., room / (perCharacter * static_cast<double>(std::max<std::size_t>(plot.yLabel.size(), 1))));
  result += format("<text transform=\"translate(14 %.1f) rotate(-90)\" text-anchor=\"middle\" font-size=\"%.1f\">",
                   .5 * height, size) +
            escaped(plot.yLabel) + "</text>";
  return result;
}

/// Names under each other, right of the plot.
std::string legend(const Plot& plot)
{
  std::string result;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const double y = top + 10 + 19 * static_cast<double>(i), x = width + 4;
    if (plot.kind == Plot::Kind::lines)
      result +=
          format("<path d=\"M%.1f %.1fh20\" stroke=\"%s\" stroke-width=\"1.8\"/>", x, y, colors[i % colors.size()]) +
          mark(i, x + 10, y);
    else
      result += format("<rect x=\"%.1f\" y=\"%.1f\" width=\"14\" height=\"10\" fill=\"%s\"/>", x + 3, y - 5,
                       colors[i % colors.size()]);
    result += format("<text x=\"%.1f\" y=\"%.1f\">", x + 27, y + 4) + escaped(plot.curves[i].name) + "</text>";
  }
  return result;
}

std::string lines(const Plot& plot, const Axis& x, const Axis& y)
{
  std::string result;
  for (std::size_t c = 0; c < plot.curves.size(); ++c) {
    const Curve& curve = plot.curves[c];
    std::string path, marks;
    const std::size_t count = std::min(curve.x.size(), curve.y.size());
    bool isPenDown = false;
    for (std::size_t i = 0; i < count; ++i) {
      if (!x.holds(curve.x[i]) || !y.holds(curve.y[i])) {
        isPenDown = false;
        continue;
      }
      const double px = x.place(curve.x[i]), py = y.place(curve.y[i]);
      path += format("%s%.1f %.1f", isPenDown ? "L" : "M", px, py);
      if (count <= 40)
        marks += mark(c, px, py);
      isPenDown = true;
    }
    if (!path.empty())
      result.append("<path d=\"")
          .append(path)
          .append(format("\" fill=\"none\" stroke=\"%s\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>",
                         colors[c % colors.size()]))
          .append(marks);
  }
  return result;
}

/// The smallest distance between two places of bars; 1 if there is only one.
double barStep(const Plot& plot)
{
  std::vector<double> places;
  for (const Curve& curve : plot.curves)
    places.insert(places.end(), curve.x.begin(), curve.x.end());
  std::sort(places.begin(), places.end());
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < places.size(); ++i)
    if (places[i] - places[i - 1] > 1e-9 * std::max(1., std::abs(places[i])))
      step = std::min(step, places[i] - places[i - 1]);
  return std::isfinite(step) ? step : 1;
}

std::string bars(const Plot& plot, const Axis& x, const Axis& y, double step)
{
  std::string result;
  const double base = y.place(y.isLog ? y.lower : std::clamp(0., y.lower, y.upper));
  const double room = .84 * (x.place(x.lower + step) - x.begin);
  const double each = room / static_cast<double>(plot.curves.size());
  for (std::size_t c = 0; c < plot.curves.size(); ++c) {
    const Curve& curve = plot.curves[c];
    for (std::size_t i = 0; i < std::min(curve.x.size(), curve.y.size()); ++i) {
      if (!x.holds(curve.x[i]) || !y.holds(curve.y[i]))
        continue;
      const double at = y.place(curve.y[i]);
      result += format("<rect x=\"%.2f\" y=\"%.1f\" width=\"%.2f\" height=\"%.1f\" fill=\"%s\"/>",
                       x.place(curve.x[i]) - .5 * room + each * static_cast<double>(c), std::min(at, base),
                       std::max(each - .4, .4), std::abs(at - base), colors[c % colors.size()]);
    }
  }
  return result;
}

std::string numberText(double value)
{
  const double magnitude = std::abs(value);
  if (magnitude >= 1e5 || (magnitude > 0 && magnitude < 1e-3)) {
    const int exponent = static_cast<int>(std::floor(std::log10(magnitude) + 1e-9));
    const double mantissa = value / std::pow(10., exponent);
    const std::string power = format("10<tspan dy=\"-5\" font-size=\"9\">%d</tspan>", exponent);
    return std::abs(mantissa - 1) < 1e-9 ? power : format("%.3g·", mantissa) + power;
  }
  return format("%.6g", value);
}

} // namespace

std::vector<Tick> ticks(double lower, double upper, bool isLog, int count)
{
  std::vector<Tick> result;
  if (isLog) {
    const int first = static_cast<int>(std::floor(std::log10(lower))),
              last = static_cast<int>(std::ceil(std::log10(upper)));
    // Over many decades only some of them are named, over few the parts between as well.
    const int stride = std::max(1, (last - first + count) / (count + 1));
    const bool hasParts = std::log10(upper / lower) < 2.2;
    for (int exponent = first; exponent <= last; ++exponent)
      for (int digit = 1; digit < 10; ++digit) {
        const double value = digit * std::pow(10., exponent);
        if (value < lower * (1 - 1e-9) || value > upper * (1 + 1e-9))
          continue;
        const bool isNamed = digit == 1 ? exponent % stride == 0 : hasParts && (digit == 2 || digit == 5);
        if (isNamed || stride == 1)
          result.push_back({value, isNamed ? numberText(value) : std::string()});
      }
    return result;
  }
  const double raw = (upper - lower) / std::max(count, 1);
  const double power = std::pow(10., std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {1., 2., 2.5, 5.})
    if (factor * power >= raw * (1 - 1e-9)) {
      step = factor * power;
      break;
    }
  // Adding zero turns −0 into 0.
  for (double index = std::ceil(lower / step - 1e-9) + 0.; index * step <= upper + 1e-9 * step; ++index)
    result.push_back({index * step, numberText(index * step)});
  return result;
}

std::string toSvg(const Plot& plot)
{
  Axis x, y;
  x.isLog = plot.logX;
  y.isLog = plot.logY;
  x.begin = left;
  x.end = width - right;
  y.begin = height - bottom;
  y.end = top;
  const bool isBars = plot.kind == Plot::Kind::bars;
  const double step = isBars ? barStep(plot) : 0;
  std::vector<double> xs, ys;
  std::size_t longest = 0;
  for (const Curve& curve : plot.curves) {
    for (const double value : curve.x) {
      xs.push_back(value - .5 * step);
      xs.push_back(value + .5 * step);
    }
    ys.insert(ys.end(), curve.y.begin(), curve.y.end());
    longest = std::max(longest, curve.name.size());
  }
  fit(x, xs, false, false);
  fit(y, ys, isBars || !plot.logY, !plot.logY);
  const bool hasLegend = plot.curves.size() > 1;
  const double wholeWidth = width + (hasLegend ? 36 + 6.2 * static_cast<double>(longest) : 0);
  std::string result =
      format("<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f "
             "%.0f\" font-size=\"12\" fill=\"#1d2329\" font-family=\"sans-serif\">",
             wholeWidth, height, wholeWidth, height);
  result += "<title>" + escaped(plot.title) + "</title>" +
            format("<text x=\"%.0f\" y=\"18\" font-weight=\"600\" font-size=\"13\">", left) + escaped(plot.title) +
            "</text>";
  result += grid(plot, x, y);
  result += isBars ? bars(plot, x, y, step) : lines(plot, x, y);
  if (hasLegend)
    result += legend(plot);
  return result + "</svg>";
}

} // namespace mrf_apps
