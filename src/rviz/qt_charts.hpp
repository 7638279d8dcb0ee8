// Qt's charts under one name: in a namespace of their own in Qt 5 (Debian 12), in none in Qt 6 (Debian 13).
#pragma once

#include <QtCharts/QAreaSeries>
#include <QtCharts/QChart>
#include <QtCharts/QChartView>
#include <QtCharts/QLegend>
#include <QtCharts/QLineSeries>
#include <QtCharts/QScatterSeries>
#include <QtCharts/QValueAxis>

#if QT_VERSION >= QT_VERSION_CHECK(6, 0, 0)
namespace QtCharts {
using ::QAbstractSeries;
using ::QAreaSeries;
using ::QChart;
using ::QChartView;
using ::QLegend;
using ::QLineSeries;
using ::QScatterSeries;
using ::QValueAxis;
}  // namespace QtCharts
#endif
