/// \file
/// All inputs of a run as plain data. Values are in SI units, angles in radians. inputs/schema.hpp has the allowed
/// range of each, docs/model.md and docs/accident_model.md have the equations in which they occur.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/abi.hpp"

namespace train_derail::inputs {

/// SI values of units that people read, and in which the paper states its values; all exact by definition.
inline constexpr double kFoot = 0.3048;                     ///< m
inline constexpr double kMph = 0.44704;                     ///< m/s
inline constexpr double kPoundForce = 4.4482216152605;      ///< N
inline constexpr double kKip = 1000.0 * kPoundForce;        ///< N
inline constexpr double kDegree = 0.017453292519943295769;  ///< rad
inline constexpr double kStandardGravity = 9.80665;         ///< m/s^2

/// "No limit", .inf in a file.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Whether a block opens the brake pipe by itself, besides passing the signal on.
enum class BrakeSource {
  none,
  remote,  ///< a distributed locomotive or an end-of-train device, which opens the pipe when it is told by radio
};

/// Shape of a body, where it presses on the ground and on other bodies, Model::spatial only.
enum class BodyShape {
  box,
  cylinder,  ///< a tank, which can roll: along the car, as wide or as high as the box, whichever is less, with heads
             ///< that are half spheres
};

/// `count` equal cars, one behind the other. The blocks of a consist follow each other from the foremost car back.
struct CarBlock {
  std::string name = "car";             ///< kind of car; chooses the body in pictures (scene/car_shape.hpp)
  int count = 0;                        ///< number of cars
  double length = 0.0;                  ///< L, distance between the coupler pins [m]
  double weight = 0.0;                  ///< W, weight of one car [N]
  std::optional<double> loaded_weight;  ///< of one car with a full load, which Brakes::force is a share of; else W [N]
  double width = 10.0 * kFoot;          ///< width of the footprint [m]
  std::optional<double> truck_spacing;  ///< D, distance between the truck centres [m]
  std::optional<double> truck_spacing_factor;  ///< D / L, instead of truck_spacing [-]
  std::optional<double> yaw_inertia;           ///< I, about the vertical axis through the centre of mass [kg m^2]
  std::optional<double> yaw_inertia_factor;    ///< I / (M L^2), instead of yaw_inertia [-]
  std::optional<double> centre_height;         ///< of the centre of mass above the rail; else by name and weight [m]
  std::optional<double> floor_height;          ///< of the underside of the body above the rail; else by name [m]
  std::optional<double> roof_height;           ///< of the top of the body above the rail; else by name [m]
  std::optional<double> underframe_height;     ///< of what the body lies on without trucks; else by name [m]
  std::optional<double> underframe_width;      ///< of that; else by name [m]
  std::optional<double>
      truck_weight;  ///< of one truck with its wheels, which it takes along as it parts; else by name [N]
  std::optional<double> roll_inertia;   ///< about the axis along the car through the centre of mass; else that of a box
                                        ///< (of a cylinder for tank_car) [kg m^2]
  std::string coupler_type;             ///< of its couplers, as Coupler::type; "": that
  BodyShape shape = BodyShape::box;     ///< of the body
  std::optional<double> tank_strength;  ///< speeds of Release for these cars over those of a bare tank; .inf: nothing
                                        ///< to release; else 1 for tank_car, .inf for others [-]
  double brake_share = 1.0;             ///< share of Brakes::force that these cars develop; 0: brakes cut out [-]
  BrakeSource brake_source = BrakeSource::none;  ///< whether the block opens the brake pipe

  /// D / L if neither truck spacing is given [-].
  static constexpr double kDefaultTruckSpacingFactor = 0.71;
  /// I / (M L^2) if neither yaw inertia is given [-].
  static constexpr double kDefaultYawInertiaFactor = 0.093;
};

/// Blocks of locomotives have that word in their name.
inline bool is_locomotive(const CarBlock& block) { return block.name.find("locomotive") != std::string::npos; }

/// Coupler between two cars: a massless bar with a pin at each end (paper, figures 2 to 4). All couplers are alike.
struct Coupler {
  double length = 4.0 * kFoot;  ///< G0, gap from pin to pin at mid-slack [m]
  double slack = 0.25 * kFoot;  ///< s, whole range of the gap without axial force, half on either side of G0 [m]
  double stiffness = 50.0e6 * kPoundForce / kFoot;  ///< K, in buff and draft, beyond slack and draft gear [N/m]
  double swing_limit = 17.5 * kDegree;              ///< S, swing to either side at which the swing stop begins [rad]
  double swing_stiffness = 3.6e4 * kPoundForce * kFoot;       ///< K_m, stiffness of the swing stop [N m/rad]
  double swing_moment_max = kInfinity;                        ///< m_max, largest moment of the swing stop [N m]
  double draft_gear_stiffness = 1.5e6 * kPoundForce / kFoot;  ///< k_1, over the travel of the draft gear [N/m]
  double draft_gear_travel = 0.0;  ///< T, travel beyond the slack; then `stiffness` acts; 0: no draft gear [m]
  double damping_ratio = 0.0;      ///< of two cars on the first spring; damping never changes the sign of the force [-]
  double break_draft = kInfinity;  ///< draft force at which the coupler breaks [N]
  double break_swing = kInfinity;  ///< swing at either end at which the coupler breaks [rad]
  double break_moment = kInfinity;  ///< |sum of the end moments| at which the coupler breaks [N m]
  // Model::spatial only.
  double height = 33.0 / 12.0 * kFoot;  ///< of the pins above the rail [m]
  std::string type = "E_shelf";  ///< of inputs/car_types.hpp; what is left out below follows from it (coupler_hold)
  double butt_height = 5.0 / 12.0 * kFoot;               ///< of the faces that press in buff, against pitch [m]
  std::optional<double> pitch_limit;                     ///< swing up and down at which the vertical stop begins [rad]
  double pitch_stiffness = 3.6e6 * kPoundForce * kFoot;  ///< of that stop [N m/rad]
  std::optional<double> slip_height;                     ///< pins that far apart in height let go [m]
  std::optional<double> vertical_hold;                   ///< vertical force at which the coupler breaks [N]
  std::optional<double> roll_limit;                      ///< roll of one car against the next at which they bind [rad]
  double roll_stiffness = 1.0e6 * kPoundForce * kFoot;   ///< of one car against the next beyond it [N m/rad]
  double break_twist = 150.0e3 * kPoundForce * kFoot;    ///< torque between two cars at which the coupler breaks [N m]
};

/// Springs of the trucks, Model::spatial only.
struct Suspension {
  double stiffness = 24.0e3 * 12.0 * kPoundForce / kFoot;  ///< vertical, of one side of a truck [N/m]
  double damping_ratio = 0.2;                              ///< of a quarter of the car on one side [-]
  double half_base = 29.75 / 12.0 * kFoot;                 ///< of a side's support from the middle of the track [m]
  double part_angle = 45.0 * kDegree;  ///< roll of the body at which a truck that carries nothing parts from it [rad]
};

/// Stretch of track with another cross-section. What is left out is as elsewhere.
struct TerrainSection {
  double start = 0.0;                        ///< arc length where it begins, from the point of derailment, forward [m]
  double length = 0.0;                       ///< its length [m]
  std::optional<double> ballast_height;      ///< m
  std::optional<double> ballast_half_width;  ///< m
  std::optional<double> ballast_slope;       ///< fall over run [-]
  std::optional<double> crown;               ///< m
  std::optional<double> bank_slope;          ///< fall over run [-]
  std::optional<double> bank_left;           ///< m
  std::optional<double> bank_right;          ///< m
};

/// Heights across the track at one x of a TerrainGrid.
struct TerrainGridRow {
  std::string heights;  ///< numbers apart by blanks, from right to left, above the top of the rails at x = 0 [m]
};

/// Heights of the ground at the knots of a grid, in the world frame: x ahead from the point of derailment, y to the
/// left. Between knots heights are bilinear; beyond the outermost knots they are those of the edge.
struct TerrainGrid {
  double spacing = 5.0;              ///< between neighbouring knots, in x and in y [m]
  double x_from = 0.0;               ///< of the first row [m]
  double y_from = 0.0;               ///< of the first height of each row [m]
  double seam = 2.0;                 ///< width beyond the crown over which the roadbed becomes the grid [m]
  std::vector<TerrainGridRow> rows;  ///< ahead, `spacing` apart; none: no grid
};

/// Ground beside the track and how bodies lie on it, Model::spatial only. Flat by default.
struct Terrain {
  double rail_height = 7.25 / 12.0 * kFoot;             ///< top of the rails above the ballast [m]
  double ballast_height = 0.0;                          ///< top of the ballast above the crown of the roadbed [m]
  double ballast_half_width = 5.25 * kFoot;             ///< half the width of the top of the ballast [m]
  double ballast_slope = 0.5;                           ///< fall over run of the sides of the ballast [-]
  double crown = 9.0 * kFoot;                           ///< half the width of the crown of the roadbed [m]
  double bank_slope = 0.5;                              ///< fall over run of the banks beside it [-]
  double bank_left = 0.0;                               ///< height of the bank on the left; negative: a cut [m]
  double bank_right = 0.0;                              ///< on the right [m]
  double body_friction = 0.5;                           ///< of a body on the ground [-]
  double body_stiffness = 1.5e6 * kPoundForce / kFoot;  ///< of the ground under a corner of a body [N/m]
  double body_damping_ratio = 0.4;                      ///< of a quarter of the car on it [-]
  double rolling_resistance = 0.15;                     ///< of a BodyShape::cylinder, by its load and radius [-]
  double transition = 100.0 * kFoot;                    ///< over which one cross-section changes into the next [m]
  std::vector<TerrainSection> sections;                 ///< in the order of their start, without overlap
  TerrainGrid grid;                                     ///< instead of banks and sections
  double rest_speed = 0.01;  ///< cars that hardly move come to rest, spatial model; 0: never [m/s]
};

/// Lateral force on a car that is on the track. The paper does not say what it is (docs/model.md, section 2).
enum class OnTrackLaw {
  isotropic,    ///< Coulomb friction against the velocity of the truck, in any direction
  along_track,  ///< friction along x only; no lateral force
  guided,       ///< rigid rails hold y = 0 and theta = 0 until the car passes the point of derailment
  rails,        ///< elastic rails that yield, see Rails
};

/// Friction of the ground on a truck that is off the rails.
enum class OffTrackLaw {
  coulomb,  ///< constant: Ground::off_track_friction
  by_slip,  ///< rises with slip angle and distance from the track, from in_line_friction to broadside_friction
};

/// Rectangle of ground with another friction. x: along the track from the point of derailment; y: to the left of it.
struct GroundPatch {
  double x_from = 0.0, x_to = 0.0, y_from = 0.0, y_to = 0.0;  ///< edges [m]
  double factor = 1.0;                                        ///< friction here over friction elsewhere [-]
};

/// Friction under the trucks.
struct Ground {
  double on_track_friction = 0.15;                   ///< mu of a car before the point of derailment [-]
  double off_track_friction = 0.50;                  ///< mu of a car past the point of derailment [-]
  OnTrackLaw on_track_law = OnTrackLaw::isotropic;   ///< lateral force on the track
  double regularization_speed = 0.1 * kFoot;         ///< v_eps: friction is mu N v / sqrt(v^2 + v_eps^2) [m/s]
  OffTrackLaw off_track_law = OffTrackLaw::coulomb;  ///< friction off the rails
  double in_line_friction = 0.25;     ///< mu_0 of a truck that slides along its car's axis on the track bed [-]
  double broadside_friction = 0.75;   ///< mu_1 of a truck that slides across that axis, or is far from the track [-]
  double slip_ratio = 0.35;           ///< |v across the car| / |v| at which mu_1 is reached [-]
  double far_distance = 7.0 * kFoot;  ///< distance from the rail at which mu_1 is reached [m]
  double load_exponent = 1.0;         ///< friction off the rails grows with the weight of a car to this power [-]
  double reference_weight = 286.0 * kKip;  ///< weight of a car at which that power changes nothing [N]
  double rest_speed = 0.1;  ///< cars off the rails that stay slower come to rest, extended model; 0: never [m/s]
  std::vector<GroundPatch> patches;  ///< rectangles of other friction; factors multiply where they overlap
};

/// Rails that hold a truck sideways until they yield (OnTrackLaw::rails).
struct Rails {
  double stiffness = 2.0e6 * kPoundForce / kFoot;  ///< k_r, lateral stiffness under one truck [N/m]
  double damping_ratio = 0.15;                     ///< damping ratio of half a car on k_r [-]
  double derail_ratio = 0.9;            ///< L/V: lateral force over load beyond which a truck leaves the rails [-]
  double derail_time = 0.02;            ///< time for which L/V must be exceeded without interruption [s]
  double flange_height = kFoot / 12.0;  ///< lift of the wheels of one side beyond which nothing guides a truck [m]
  double torn_length = 5.0 * kFoot;  ///< length of track that a truck tears up where it leaves the rails; 0: none [m]
  double rolling_share = 0.2;  ///< of derail_ratio, up to which cars only roll, extended model; 0: they never do [-]
  double load_exponent = 1.0;  ///< the limit of the lateral force grows with the weight to this power [-]
  double reference_weight = 286.0 * kKip;  ///< weight of a car at which that power changes nothing [N]
};

/// What holds a truck that is off the rails, but still between or beside them.
enum class TieLaw {
  none,    ///< nothing: the ground alone acts on it
  guided,  ///< it runs on the ties, guided by rails and ties, until it is thrown off the track bed, see Ties
};

/// A truck that runs on the ties (TieLaw::guided); not in Model::paper.
struct Ties {
  TieLaw law = TieLaw::none;                       ///< what holds it
  double drag = 0.25;                              ///< along the track, over its load [-]
  double stiffness = 0.5e6 * kPoundForce / kFoot;  ///< k_t, lateral, up to the limit [N/m]
  double damping_ratio = 0.3;                      ///< of half a car on k_t [-]
  double lateral_ratio = 0.6;                      ///< limit of the lateral force over its load; beyond it drifts [-]
  double drift_max = 2.0 * kFoot;                  ///< a truck that has drifted farther leaves the track bed [m]
  double parting_rate = 0.0;                       ///< at which a running truck parts the brake pipe, a length [1/m]
};

/// A place at which a truck that runs on the ties may be thrown off the track bed.
struct ObstaclePlace {
  double at = 0.0;                          ///< along the track from the point of derailment, forward [m]
  std::optional<double> throw_probability;  ///< as Obstacles has it if left out [-]
};

/// Turnouts, crossings and bridges, which throw trucks that run on the ties off the track bed.
struct Obstacles {
  double rate = 0.0;                   ///< of places at random along the track, a length [1/m], at reference_speed
  double speed_exponent = 0.0;         ///< k: the rate goes with (InitialMotion::speed / reference_speed)^-k [-]
  double reference_speed = 25 * kMph;  ///< see speed_exponent [m/s]
  double throw_probability = 0.5;      ///< that one throws a truck off [-]
  double throw_speed = 4.5 * kFoot;    ///< sideways speed of a truck that is thrown off, to either side [m/s]
  std::vector<ObstaclePlace> places;   ///< places that are known
};

/// Arc of constant curvature. The track is straight between the arcs and outside of them.
struct Curve {
  double start = 0.0;           ///< arc length where it begins, from the point of derailment, forward [m]
  double length = 0.0;          ///< length of the arc [m]
  double curvature = 0.0;       ///< 1 / radius, positive to the left [1/m]
  double superelevation = 0.0;  ///< of the outer rail over the inner one, Model::spatial only [m]
};

/// Stretch of track that rises or falls, Model::spatial only. The track is level between these and outside of them.
struct GradeSection {
  double start = 0.0;   ///< arc length where it begins, from the point of derailment, forward [m]
  double length = 0.0;  ///< its length [m]
  double grade = 0.0;   ///< rise over run in the direction of travel, uphill positive [-]
};

/// Direction, curves and grades of the track. Curves and grades need OnTrackLaw::rails.
struct Track {
  std::optional<double> heading;  ///< of travel at the point of derailment, clockwise from north; for pictures [rad]
  double grade = 0.0;             ///< of the whole track, rise over run in the direction of travel, uphill positive [-]
  std::vector<Curve> curves;      ///< in the order of their start, without overlap
  std::vector<GradeSection> grades;  ///< heights beside `grade`; in the order of their start, without overlap
};

/// How cars on the track are braked.
enum class BrakeLaw {
  friction,  ///< as in the paper: Ground::on_track_friction on every car from the start
  air,       ///< an emergency application that runs along the brake pipe and builds up
};

/// How the brake signal travels: along the air pipe, or to all cars at once (ECP).
enum class BrakeSignal { pneumatic, electronic };

/// Brakes of the cars on the track. All but `law` belong to BrakeLaw::air.
struct Brakes {
  BrakeLaw law = BrakeLaw::friction;   ///< how cars are braked
  double rolling_resistance = 0.0015;  ///< rolling resistance over weight [-]
  double force = 0.05;                 ///< B, full brake force over weight in an emergency; 0: a runaway train [-]
  double build_up_time = 12.0;         ///< t_b, time in which the force rises linearly from 0 to B [s]
  double dead_time = 1.0;              ///< delay of each car's valve after the signal [s]
  double propagation_speed = 920.0 * kFoot;     ///< speed of the signal along the brake pipe [m/s]
  double radio_delay = 2.0;                     ///< delay of brake sources that are told by radio [s]
  BrakeSignal signal = BrakeSignal::pneumatic;  ///< how the signal travels
  std::optional<double> emergency_time;         ///< time of the application [s]; none: when the first coupler breaks
  double emergency_speed_exponent = 0.0;        ///< k: that time goes with (speed / reference_speed)^-k [-]
  double reference_speed = 25.0 * kMph;         ///< see emergency_speed_exponent [m/s]
};

/// What locomotives do until the emergency signal comes to them.
enum class TractionLaw {
  none,    ///< they coast, as all cars do
  steady,  ///< they held the train at its speed when it derailed, and go on as they did
};

/// Pull of the locomotives on the rails; not in Model::paper.
struct Traction {
  TractionLaw law = TractionLaw::none;  ///< how they pull
  double adhesion = 0.25;               ///< their largest force along the track over their weight [-]
};

/// Force between two cars whose footprints overlap.
enum class ContactLaw {
  none,     ///< bodies pass through each other, as in the paper
  elastic,  ///< footprints push each other apart
};

/// Contact of any two cars.
struct Contact {
  ContactLaw law = ContactLaw::none;               ///< which force
  double stiffness = 3.0e6 * kPoundForce / kFoot;  ///< k_c, force over depth of the overlap [N/m]
  double restitution = 0.2;                        ///< e, speed after over speed before a central impact [-]
  double friction = 0.3;                           ///< friction coefficient between two bodies [-]
  double crush_force = kInfinity;                  ///< largest normal force; beyond it the bodies are crushed [N]
  double side_crush_force = kInfinity;             ///< Model::spatial: of sides, roofs and floors; the smaller acts [N]
};

/// Small random differences between runs that are equal otherwise. N(0,1) is a normal random number. A size of 0
/// switches a difference off.
struct Perturbation {
  double spacing = 0.0;         ///< every car but the first starts farther back by this * |N(0,1)| [m]
  double yaw_rate = 0.0;        ///< InitialMotion::yaw_rate is multiplied by 1 + this * N(0,1) [-]
  std::int64_t seed = 0;        ///< seed of all random numbers of the run
  double emergency_time = 0.0;  ///< Brakes::emergency_time is multiplied by exp(this * N(0,1)) [-]
  double kick = 0.0;            ///< a truck that derails at the point of derailment gets this * N(0,1) sideways [m/s]
  double alignment = 0.0;       ///< standard deviation of the lateral alignment of the rails [m]
};

/// How a derailment starts. The first car to derail is the one behind InitialMotion::cars_ahead.
enum class Mechanism {
  broken_rail,     ///< the rail ends at the point of derailment: every truck that comes there leaves the rails
  bad_track,       ///< bad track begins there: a truck leaves the rails on it with a probability
  dragging_truck,  ///< a truck of the first car is off the rails; nothing is wrong with the track
  train_forces,    ///< a train in buff has pushed it off; nothing is wrong with the track
  turnout,         ///< "switch": a truck leaves the rails at the switch point with a probability; a frog follows
};

/// The truck of the first car to derail that is off the rails at time 0, where it is not the point of derailment that
/// takes both.
enum class FirstTruck { front, rear, either };

/// Motion of the train at time 0, and how the derailment starts.
struct InitialMotion {
  double speed = 0.0;     ///< V, speed of all cars, forward along the track [m/s]
  double yaw_rate = 0.0;  ///< Omega, yaw rate of the first car to derail, counter-clockwise positive [rad/s]
  int cars_ahead = 0;     ///< foremost cars of the consist, which have passed the point of derailment on the rails
  Mechanism mechanism = Mechanism::broken_rail;  ///< how it starts
  FirstTruck truck = FirstTruck::front;          ///< which truck is off first; either: the seed decides
  double truck_probability = 0.3;                ///< of a truck to leave the rails on bad track or at a switch [-]
  std::optional<double> persistence;        ///< the same where the truck ahead left them; none: truck_probability [-]
  double bad_track_length = 100.0 * kFoot;  ///< of Mechanism::bad_track, from the point of derailment on [m]
  double frog_distance = 80.0 * kFoot;      ///< from the point of a switch to its frog, an obstacle [m]
  double buff_force = 200.0 * kKip;         ///< of Mechanism::train_forces at the first car; draft negative [N]
  Perturbation perturbation;                ///< random differences
};

/// When a run ends.
struct StopRule {
  double speed = 0.05;      ///< the run ends when every truck centre is slower than this [m/s]
  double time_max = 120.0;  ///< the run ends at this time at the latest [s]
};

/// How the outcome is counted. Without influence on the motion.
struct OutcomeRules {
  double off_track_threshold =
      0.5 * kFoot;  ///< distance of a truck centre from the centre line, beyond which a car is off track [m]
  double sample_interval = 0.01;  ///< time between two samples of counts, touches and the stop rule [s]
};

/// When a tank car releases what it holds: the probability of an impact with a closing speed normal v is
/// 1 - exp(-max(v - threshold_speed, 0) / scale), the scale by the side that is hit. Without influence on the motion.
struct Release {
  double fittings = 0.032;          ///< probability that a derailed tank car does so by valves or fittings [-]
  double threshold_speed = 0.0;     ///< least closing speed normal [m/s]
  double end_speed = 144.0 * kMph;  ///< scale where a head is hit [m/s]
  double side_speed = 72.0 * kMph;  ///< scale where a shell is hit [m/s]
};

/// When states are published and written.
struct Output {
  double interval = 0.02;  ///< simulated time from one state to the next [s]
};

/// Method of integration.
enum class Method {
  cash_karp,       ///< explicit Runge-Kutta 5(4) of Cash and Karp
  dormand_prince,  ///< explicit Runge-Kutta 5(4) of Dormand and Prince
  bdf,             ///< backward differentiation formulas, implicit
  semi_implicit,   ///< semi-implicit Euler with a fixed step; the only one for parts of the model that are not smooth
};

/// Integration in time.
struct Solver {
  Method method = Method::dormand_prince;
  double rtol = 1.0e-5;                 ///< relative tolerance of the local error [-]
  double atol = 1.0e-6;                 ///< absolute tolerance, in m, rad, m/s, rad/s
  std::optional<double> fixed_step;     ///< fixed step instead of error control, explicit and semi-implicit methods [s]
  std::int64_t steps_max = 10'000'000;  ///< a run that needs more steps has failed
  double wall_time_max = 300.0;         ///< so has a run that needs more computing time [s]
};

/// Which equations of motion a run integrates.
enum class Model {
  by_parts,  ///< extended if a part beyond the paper is switched on, else paper
  paper,     ///< Jeong, Lyons, Orringer and Perlman (2007), smooth but for the passing of the point of derailment
  spatial,   ///< the extended model's parts in three dimensions
  extended,  ///< the paper's and the parts that it lacks; only steps of fixed length, by Method::semi_implicit
};

/// All inputs of one run; one member for each group of keys.
struct Scenario {
  std::string title;  ///< one line for tables and pictures
  Model model = Model::by_parts;
  std::vector<CarBlock> consist;  ///< from the foremost car back
  Coupler coupler;
  Ground ground;
  Rails rails;
  Ties ties;
  Obstacles obstacles;
  Track track;
  Brakes brakes;
  Traction traction;
  Contact contact;
  Suspension suspension;
  Terrain terrain;
  InitialMotion initial;
  StopRule stop;
  Release release;
  OutcomeRules outcome;
  Output output;
  Solver solver;
  /// What the reader took for what a train list does not say, one line each; without influence on the motion. They are
  /// among the warnings().
  std::vector<std::string> assumptions;
};

/// A part that is switched on: the key that does so, and its value.
struct PartOn {
  std::string key, value;
};
/// Returns all parts beyond the paper's model that are switched on.
std::vector<PartOn> parts_beyond_the_paper(const Scenario& scenario);

/// The model that the scenario asks for: Model::paper, Model::extended or Model::spatial.
Model model_of(const Scenario& scenario);

}  // namespace train_derail::inputs
