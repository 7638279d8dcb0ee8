/// \file
/// The module train_derail._core: what the package train_derail is made of.
#include <functional>
#include <mutex>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/columns.hpp"
#include "python/interruptible.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/expect.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/warnings.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/outcome/incidents_csv.hpp"
#include "train_derail/simulation/fields.hpp"
#include "train_derail/simulation/output_grid.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/simulation/times.hpp"
#include "train_derail/study/counts.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::python {

namespace {

using Changes = std::vector<std::pair<std::string, std::string>>;  // keys and values
constexpr const char* kArgument = "argument";                      // where mistakes are
using OnProgress = std::optional<std::function<void(std::int64_t, std::int64_t)>>;

std::vector<inputs::Override> overrides(const Changes& changes) {
  std::vector<inputs::Override> all;
  for (const auto& [key, value] : changes) all.push_back({key, value});
  return all;
}

/// A scenario with what it was made from: each change acts on the file, as --set does, so that errors still name its
/// lines.
class Scenario {
 public:
  Scenario(inputs::Layers layers, std::string source, std::vector<inputs::Override> given)
      : layers_(std::move(layers)),
        source_(std::move(source)),
        given_(std::move(given)),
        scenario_(inputs::read_scenario(layers_, source_, given_)) {}

  static Scenario from_tree(const YAML::Node& tree, const std::string& source, const Changes& changes) {
    const auto slash = source.rfind('/');
    return {inputs::layers(tree, source, slash == std::string::npos ? "" : source.substr(0, slash + 1)), source,
            overrides(changes)};
  }
  Scenario changed(const Changes& changes) const {
    std::vector<inputs::Override> all = given_;
    for (const inputs::Override& o : overrides(changes)) all.push_back(o);
    return {layers_, source_, all};
  }

  const inputs::Scenario& get() const { return scenario_; }
  const std::string& source() const { return source_; }
  std::vector<std::string> warnings() const {
    std::vector<std::string> texts;
    for (const inputs::Warning& w : inputs::warnings(scenario_, given_)) texts.push_back(inputs::to_string(w));
    return texts;
  }

 private:
  inputs::Layers layers_;
  std::string source_;
  std::vector<inputs::Override> given_;
  inputs::Scenario scenario_;
};

/// A run. One thread at a time: while one computes, the interpreter is free for others.
class Simulation {
 public:
  explicit Simulation(const Scenario& scenario) : run_(scenario.get()) {}
  /// Goes on from a file of save().
  Simulation(const Scenario& scenario, const std::string& saved)
      : run_(scenario.get(), simulation::read_checkpoint(saved)) {}

  void save(const std::string& path, bool replace) const {
    const simulation::Checkpoint checkpoint = idle().checkpoint();
    files::OutputFile file(path, replace ? files::Existing::replace : files::Existing::refuse, nullptr,
                           files::Compression::never);
    simulation::write_checkpoint(checkpoint, file.stream());
    file.commit();
  }
  void run() {
    const Turn turn(*this);
    interruptibly([this](const std::atomic<bool>& stop) { run_.run(&stop); });
  }
  void advance(double t) {
    if (const std::string flaw = simulation::flaw_of_time(t); !flaw.empty())
      throw inputs::InputError(kArgument, "t", py::str(py::float_(t)), flaw, "a time of the run [s], from 0 on");
    const Turn turn(*this);
    interruptibly([this, t](const std::atomic<bool>& stop) { run_.advance(t, &stop); });
  }
  /// To the next point of the output grid.
  void step() {
    const Turn turn(*this);
    interruptibly([this](const std::atomic<bool>& stop) { simulation::OutputGrid(run_).advance(&stop); });
  }
  /// To the end, with the states on the output grid from now on.
  py::dict record() {
    const Turn turn(*this);
    std::vector<double> times;
    Columns<simulation::CarSnapshot> cars(simulation::car_fields());
    Columns<simulation::CouplerSnapshot> couplers(simulation::coupler_fields());
    const auto note = [&] {
      const simulation::Snapshot now = run_.snapshot();
      times.push_back(now.time);
      for (const auto& car : now.cars) cars.add(car);
      for (const auto& coupler : now.couplers) couplers.add(coupler);
    };
    interruptibly([&](const std::atomic<bool>& stop) {
      note();
      for (simulation::OutputGrid grid(run_); !run_.ended() && !stop;) {
        if (grid.advance(&stop)) note();
      }
    });
    const auto rows = static_cast<py::ssize_t>(times.size()), n = static_cast<py::ssize_t>(run_.cars().size());
    py::dict states;
    states["time"] = py::array_t<double>(rows, times.data());
    states["cars"] = cars.take({rows, n});
    states["couplers"] = couplers.take({rows, n - 1});
    return states;
  }

  double time() const { return idle().time(); }
  bool ended() const { return idle().ended(); }
  py::dict cars() const {
    const simulation::Snapshot now = idle().snapshot();
    Columns<simulation::CarSnapshot> columns(simulation::car_fields());
    for (const auto& car : now.cars) columns.add(car);
    return columns.take({static_cast<py::ssize_t>(now.cars.size())});
  }
  py::dict couplers() const {
    const simulation::Snapshot now = idle().snapshot();
    Columns<simulation::CouplerSnapshot> columns(simulation::coupler_fields());
    for (const auto& coupler : now.couplers) columns.add(coupler);
    return columns.take({static_cast<py::ssize_t>(now.couplers.size())});
  }
  py::dict outcome() const { return to_dict(outcome::outcome_fields(), idle().outcome()); }
  std::string incidents() const {
    std::ostringstream out;
    outcome::write_incidents_csv(out, idle().incidents());
    return out.str();
  }

 private:
  /// Marks that a thread computes with this run. Made and unmade with the interpreter held.
  class Turn {
   public:
    explicit Turn(Simulation& s) : s_(s) {
      static_cast<void>(s.idle());
      s_.busy_ = true;
    }
    ~Turn() { s_.busy_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Simulation& s_;
  };
  const simulation::Simulation& idle() const {
    if (busy_) throw std::runtime_error("another thread computes with this simulation: give each thread its own");
    return run_;
  }

  simulation::Simulation run_;
  bool busy_ = false;
};

/// Tells of the progress of many runs: the threads that compute note it, the caller's thread says it.
class ProgressSaid {
 public:
  explicit ProgressSaid(OnProgress say) : say_(std::move(say)) {}
  void note(const study::Progress& p) {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ = p.done;
    total_ = p.total;
  }
  void say() {
    std::int64_t done = 0, total = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      std::tie(done, total) = std::pair(done_, total_);
    }
    if (!say_ || done == said_) return;
    said_ = done;
    (*say_)(done, total);
  }

 private:
  OnProgress say_;
  std::mutex mutex_;
  std::int64_t done_ = 0, total_ = 0, said_ = 0;
};

/// 0 threads: one a core.
constexpr study::Bounds kJobs{0, study::kJobs.most};

/// A whole number within bounds; refused in the words of the command line.
int count(const study::Bounds& bounds, const char* name, const py::object& value) {
  const bool whole = PyIndex_Check(value.ptr()) != 0 && !PyBool_Check(value.ptr());
  PyObject* text = whole ? PyNumber_ToBase(value.ptr(), 10) : PyObject_Repr(value.ptr());
  if (text == nullptr) throw py::error_already_set();
  return study::count(bounds, kArgument, name, py::reinterpret_steal<py::str>(text));
}

/// The runs of `derail run --seeds`: outcomes, table as CSV, summary as JSON, warnings.
py::tuple ensemble(const Scenario& scenario, const py::object& seeds, const py::object& jobs,
                   const OnProgress& on_progress) {
  const study::Study study = study::ensemble_of(scenario.get(), count(study::kSeeds, "seeds", seeds));
  const int threads = count(kJobs, "jobs", jobs);
  ProgressSaid progress(on_progress);
  std::vector<std::string> warnings;
  const std::vector<outcome::Outcome> outcomes = interruptibly(
      [&](const std::atomic<bool>& stop) {
        warnings = study::check(study, &stop);
        return study::run_in_memory(
            study, threads, [&progress](const study::Progress& p) { progress.note(p); }, stop);
      },
      [&progress] { progress.say(); });
  progress.say();
  py::list dicts;
  for (const outcome::Outcome& o : outcomes) dicts.append(to_dict(outcome::outcome_fields(), o));
  return py::make_tuple(dicts, study::ensemble_csv(study, outcomes), study::ensemble_json(study, outcomes), warnings);
}

/// The runs and tables of `derail study` in a folder. Returns the warnings.
std::vector<std::string> run_study(const std::string& path, const std::string& folder, const Changes& changes,
                                   const py::object& replicates, const py::object& jobs, bool resume,
                                   const OnProgress& on_progress) {
  inputs::expect(files::FileKind::study, path);
  study::Study study = study::read_study_file(path, overrides(changes));
  if (!replicates.is_none()) study.replicates = count(study::kReplicates, "replicates", replicates);
  const int threads = count(kJobs, "jobs", jobs);
  ProgressSaid progress(on_progress);
  std::vector<std::string> warnings = interruptibly(
      [&](const std::atomic<bool>& stop) {
        std::vector<std::string> said = study::check(study, &stop);
        const study::RunReport report = study::run_study(
            study, {folder, threads, resume, {}}, [&progress](const study::Progress& p) { progress.note(p); }, stop);
        if (report.stopped) throw study::Stopped();
        const study::Totals totals = study::write_results(folder, study, report.wall_time, &stop);
        said.insert(said.end(), totals.warnings.begin(), totals.warnings.end());
        return said;
      },
      [&progress] { progress.say(); });
  progress.say();
  return warnings;
}

constexpr const char* kInputError = "InputError";

void add_errors(py::module_& m) {
  m.attr(kInputError) = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
      "train_derail.InputError",
      "A mistake in an input: where it is, its key and value as written, the problem, and the range that is "
      "allowed.\n\n"
      "Attributes, each a text, empty if there is nothing to say: where, key, value, problem, range.",
      PyExc_ValueError, nullptr));
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const inputs::InputError& e) {
      const py::object type = py::module_::import("train_derail._core").attr(kInputError);
      const py::object error = type(readable(e.what()));
      error.attr("where") = readable(e.where());
      error.attr("key") = readable(e.key());
      error.attr("value") = readable(e.value());
      error.attr("problem") = readable(e.problem());
      error.attr("range") = readable(e.allowed());
      PyErr_SetObject(type.ptr(), error.ptr());
    } catch (const files::ExistsError& e) {
      PyErr_SetString(PyExc_FileExistsError, e.what());
    }
  });
}

void add_scenario(py::module_& m) {
  py::class_<Scenario>(m, "Scenario", "A scenario as the reader has understood it; it does not change.")
      .def("changed", &Scenario::changed, py::arg("changes"), "Returns it with inputs changed: pairs of key and value.")
      .def(
          "key_values",
          [](const Scenario& s) {
            py::list all;
            for (const inputs::KeyValue& v : inputs::key_values(s.get()))
              all.append(py::make_tuple(v.key, v.value, v.unit, v.shown_unit, v.whole, v.meaning));
            return all;
          },
          "Returns (key, value in SI units, unit, unit that people read, whether whole, meaning) of every key.")
      .def(
          "to_yaml", [](const Scenario& s) { return inputs::to_yaml(s.get()); },
          "Returns it as YAML in SI units, all defaults filled in, as `derail check` prints it.")
      .def("warnings", &Scenario::warnings, "Returns what is allowed, but unusual or without effect.")
      .def_property_readonly(
          "title", [](const Scenario& s) { return readable(s.get().title); }, "Its title.")
      .def_property_readonly("source", &Scenario::source, "Its name in errors: the path of its file.");
  m.def(
      "read_scenario_file",
      [](const std::string& path, const Changes& changes) {
        inputs::expect(files::FileKind::scenario, path);
        return Scenario::from_tree(inputs::load_file(path), path, changes);
      },
      py::arg("path"), py::arg("changes"), "Reads a scenario file, with inputs changed as by --set.");
  m.def(
      "read_scenario_text",
      [](const std::string& yaml, const std::string& source, const Changes& changes) {
        return Scenario::from_tree(inputs::load_text(yaml, source), source, changes);
      },
      py::arg("yaml"), py::arg("source"), py::arg("changes"),
      "Reads a scenario from text; source: its name in errors.");
  m.def(
      "saved_scenario",
      [](const std::string& path) {
        const simulation::Checkpoint saved = simulation::read_checkpoint(path);
        return Scenario::from_tree(inputs::load_text(saved.scenario, path), path, {});
      },
      py::arg("path"), "Returns the scenario of a run that was saved.");
  m.def("describe_keys", &inputs::describe_keys, "Returns the list of all keys, as `derail keys` prints it.");
}

void add_simulation(py::module_& m) {
  py::class_<Simulation>(m, "Simulation", "A run of a scenario. Threads that compute at a time need one each.")
      .def(py::init<const Scenario&>(), py::arg("scenario"))
      .def(py::init<const Scenario&, const std::string&>(), py::arg("scenario"), py::arg("saved"))
      .def("save", &Simulation::save, py::arg("path"), py::arg("replace"), "Saves the run, to go on from there.")
      .def("run", &Simulation::run, "Runs to the end.")
      .def("advance", &Simulation::advance, py::arg("t"), "Runs on to simulated time t [s], or to the end.")
      .def("step", &Simulation::step, "Runs on to the next point of the output grid, or to the end.")
      .def("record", &Simulation::record,
           "Runs to the end. Returns the states on the output grid: time, and cars and couplers by time.")
      .def("cars", &Simulation::cars, "Returns the cars now.")
      .def("couplers", &Simulation::couplers, "Returns the couplers now; coupler i joins cars i and i + 1.")
      .def("outcome", &Simulation::outcome, "Returns the outcome so far.")
      .def("incidents", &Simulation::incidents, "Returns the incidents so far as CSV.")
      .def_property_readonly("time", &Simulation::time, "Simulated time [s].")
      .def_property_readonly("ended", &Simulation::ended, "Whether the run has ended; the outcome says why.");
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.doc() = "What the package train_derail is made of. Use the package.";
  m.attr("__version__") = TRAIN_DERAIL_VERSION;
  add_errors(m);
  add_scenario(m);
  add_simulation(m);
  m.def("ensemble", &ensemble, py::arg("scenario"), py::arg("seeds"), py::arg("jobs"), py::arg("progress"),
        "Computes an ensemble. Returns outcomes, table as CSV, summary as JSON, warnings.");
  m.def("run_study", &run_study, py::arg("path"), py::arg("folder"), py::arg("changes"), py::arg("replicates"),
        py::arg("jobs"), py::arg("resume"), py::arg("progress"),
        "Runs a study and writes its results to a folder. Returns warnings.");
  m.def(
      "outcome_fields", [] { return descriptions(outcome::outcome_fields()); }, "Describes the outcome.");
  m.def(
      "car_fields", [] { return descriptions(simulation::car_fields()); }, "Describes a car at a time.");
  m.def(
      "coupler_fields", [] { return descriptions(simulation::coupler_fields()); }, "Describes a coupler at a time.");
  m.def(
      "write_file",
      [](const std::string& path, const std::string& content, bool replace) {
        files::write_file(path, content, replace ? files::Existing::replace : files::Existing::refuse);
      },
      py::arg("path"), py::arg("content"), py::arg("replace"), "Writes a file whole or not at all.");
}

}  // namespace train_derail::python
