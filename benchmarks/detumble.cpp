// The 'detumble' task in plain C++: the rival that every timing of the package is set against.
//
// Rigid body on a circular orbit, IGRF field to degree 13, gravity gradient, B-dot by finite
// differences at 1 Hz with saturated coils, RK4 with a step of one second. The field is
// evaluated afresh in every stage of RK4 and once more for the control law: 5 times a step.
// (`detumble_shared` is the same with the environment computed once per distinct time;
// -DWIDE_FIELD takes the hand-vectorised field of field_wide.h.)
//
// SI units. Inertial frame: x to the ascending node, z along the Earth's axis. Earth-fixed
// frame: turned about z by theta0 + omega_E t. Quaternion scalar last (x, y, z, w), body to
// inertial. State: quaternion, then body rate [rad/s].
//
// As a program: detumble coefficients.txt [key=value ...]; keys in `main`. Lines of the file:
// n m g h [nT]. As a shared library: the `extern "C"` functions at the end.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

constexpr int DEGREE = 13;
constexpr int TERMS = (DEGREE + 1) * (DEGREE + 2) / 2;
constexpr double FIELD_RADIUS_M = 6371200.0;
constexpr double MU_M3_S2 = 3.986004415e14;
constexpr double EARTH_RATE_RAD_S = 7.292115855306589e-5;
constexpr double DEGREE_TO_RAD = M_PI / 180.0;

struct Vec {
    double x, y, z;
};

inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec cross(Vec a, Vec b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vec scaled_by(Vec a, Vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

// ---------------------------------------------------------------------------------- field

// One term (n, m) of the series, in the order of summation: m outside, n inside.
struct Term {
    double rise, fall;  // factors of the recursion over n for Schmidt-normalised functions
    double g, h;        // Gauss coefficients [T]
};

struct GaussField {
    Term terms[TERMS];
    double sectoral[DEGREE + 1];  // P_mm / cos^m(latitude)

    // g, h: (DEGREE + 1)^2 numbers each, row n, column m [nT].
    void set(const double* g, const double* h) {
        Term* term = terms;
        for (int m = 0; m <= DEGREE; ++m) {
            sectoral[m] = m < 2 ? 1.0 : sectoral[m - 1] * std::sqrt((2.0 * m - 1.0) / (2.0 * m));
            for (int n = m; n <= DEGREE; ++n, ++term) {
                const double norm = static_cast<double>(n) * n - static_cast<double>(m) * m;
                const double before = (n - 1.0) * (n - 1.0) - static_cast<double>(m) * m;
                term->rise = n > m ? (2.0 * n - 1.0) / std::sqrt(norm) : 0.0;
                term->fall = n > m ? std::sqrt(std::max(before, 0.0) / norm) : 0.0;
                term->g = 1e-9 * g[n * (DEGREE + 1) + m];
                term->h = 1e-9 * h[n * (DEGREE + 1) + m];
            }
        }
    }

    // Field [T] at an Earth-fixed point [m]. Regular at the poles: the functions are
    // P_nm / cos^m(latitude), each multiplied by (a / r)^(n + 2), and their derivatives.
    Vec at(Vec r) const {
        const double inverse = 1.0 / std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z);
        const double s = r.x * inverse, t = r.y * inverse, u = r.z * inverse;
        const double q = FIELD_RADIUS_M * inverse, qq = q * q, uq = u * q;
        double q_power = qq;                     // (a / r)^(m + 2)
        double re = 1.0, im = 0.0;               // (s + i t)^m
        double re_before = 0.0, im_before = 0.0;  // (s + i t)^(m - 1)
        double along_x = 0.0, along_y = 0.0, along_z = 0.0, along_r = 0.0;
        const Term* term = terms;
        for (int m = 0; m <= DEGREE; ++m) {
            double p = sectoral[m] * q_power, p1 = 0.0, d = 0.0, d1 = 0.0, c = m + 1.0;
            double g_p = term->g * p, h_p = term->h * p;
            double g_d = 0.0, h_d = 0.0, g_r = c * g_p, h_r = c * h_p;
            ++term;
            for (int n = m + 1; n <= DEGREE; ++n, ++term) {
                const double fall = term->fall * qq;
                const double d2 = term->rise * (uq * d + q * p) - fall * d1;
                const double p2 = term->rise * uq * p - fall * p1;
                d1 = d, d = d2, p1 = p, p = p2, c += 1.0;
                const double gp = term->g * p, hp = term->h * p;
                g_p += gp, h_p += hp;
                g_r += c * gp, h_r += c * hp;
                g_d += term->g * d, h_d += term->h * d;
            }
            along_x += m * (g_p * re_before + h_p * im_before);
            along_y += m * (h_p * re_before - g_p * im_before);
            along_z += g_d * re + h_d * im;
            along_r += g_r * re + h_r * im;
            re_before = re, im_before = im;
            re = s * re_before - t * im_before;
            im = s * im_before + t * re_before;
            q_power *= q;
        }
        const double radial = along_r + s * along_x + t * along_y + u * along_z;
        return {radial * s - along_x, radial * t - along_y, radial * u - along_z};
    }
};

#ifdef WIDE_FIELD
#include "field_wide.h"
using Field = WideField;
#else
using Field = GaussField;
#endif

// ------------------------------------------------------------------------------- the task

struct Task {
    Vec inertia, inverse_inertia;
    double radius_m, cos_i, sin_i, theta0_rad, gain, dipole_max;
    double orbit_rate, gravity_gradient;

    Task(Vec moments, double radius, double inclination, double theta0, double k, double m_max)
        : inertia(moments),
          inverse_inertia{1.0 / moments.x, 1.0 / moments.y, 1.0 / moments.z},
          radius_m(radius),
          cos_i(std::cos(inclination)),
          sin_i(std::sin(inclination)),
          theta0_rad(theta0),
          gain(k),
          dipole_max(m_max),
          orbit_rate(std::sqrt(MU_M3_S2 / (radius * radius * radius))),
          gravity_gradient(3.0 * orbit_rate * orbit_rate) {}
};

struct Environment {
    Vec b, up;  // field [T] and unit radius vector, inertial
};

struct State {
    double x, y, z, w;
    Vec rate;
};

inline Environment environment(const Field& field, const Task& task, double t) {
    const double u = task.orbit_rate * t;
    const double theta = task.theta0_rad + EARTH_RATE_RAD_S * t;
    const double cos_u = std::cos(u), sin_u = std::sin(u);
    const double c = std::cos(theta), s = std::sin(theta);
    const Vec up{cos_u, sin_u * task.cos_i, sin_u * task.sin_i};
    const Vec b = field.at(task.radius_m * Vec{c * up.x + s * up.y, c * up.y - s * up.x, up.z});
    return {{c * b.x - s * b.y, s * b.x + c * b.y, b.z}, up};
}

inline Vec to_body(const State& state, Vec v) {
    const Vec axis{state.x, state.y, state.z};
    const Vec t = 2.0 * cross(axis, v);
    return v - state.w * t + cross(axis, t);
}

inline State derivative(const Task& task, const Environment& env, const State& at, Vec dipole) {
    const Vec up = to_body(at, env.up), rate = at.rate;
    const Vec torque = cross(dipole, to_body(at, env.b)) -
                       cross(rate, scaled_by(task.inertia, rate)) +
                       task.gravity_gradient * cross(up, scaled_by(task.inertia, up));
    return {0.5 * (at.w * rate.x + at.y * rate.z - at.z * rate.y),
            0.5 * (at.w * rate.y + at.z * rate.x - at.x * rate.z),
            0.5 * (at.w * rate.z + at.x * rate.y - at.y * rate.x),
            -0.5 * (at.x * rate.x + at.y * rate.y + at.z * rate.z),
            scaled_by(task.inverse_inertia, torque)};
}

inline State moved(const State& a, double h, const State& slope) {
    return {a.x + h * slope.x, a.y + h * slope.y, a.z + h * slope.z, a.w + h * slope.w,
            a.rate + h * slope.rate};
}

inline State normalised(const State& a) {
    const double scale = 1.0 / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z + a.w * a.w);
    return {scale * a.x, scale * a.y, scale * a.z, scale * a.w, a.rate};
}

inline State combined(const State& a, double h, const State& k1, const State& k2, const State& k3,
                      const State& k4) {
    const State middle = moved(moved(moved(a, h / 3.0, k2), h / 3.0, k3), h / 6.0, k1);
    return normalised(moved(middle, h / 6.0, k4));
}

// The environment is evaluated in every stage.
inline State step(const Field& field, const Task& task, double t, double h, const State& a,
                  Vec dipole) {
    const double half = 0.5 * h;
    const auto slope = [&](double time, const State& at) {
        return derivative(task, environment(field, task, time), at, dipole);
    };
    const State k1 = slope(t, a);
    const State k2 = slope(t + half, moved(a, half, k1));
    const State k3 = slope(t + half, moved(a, half, k2));
    const State k4 = slope(t + h, moved(a, h, k3));
    return combined(a, h, k1, k2, k3, k4);
}

inline Vec bdot(const Task& task, Vec b, Vec b_before) {
    const double limit = task.dipole_max;
    const Vec m = -task.gain * (b - b_before);
    return {std::clamp(m.x, -limit, limit), std::clamp(m.y, -limit, limit),
            std::clamp(m.z, -limit, limit)};
}

State run(const Field& field, const Task& task, State state, long n_steps, int substeps) {
    const double h = 1.0 / substeps;
    Vec b_before{};
    for (long i = 0; i < n_steps; ++i) {
        const double t = static_cast<double>(i);
        const Vec b = to_body(state, environment(field, task, t).b);
        const Vec dipole = i == 0 ? Vec{} : bdot(task, b, b_before);
        b_before = b;
        for (int j = 0; j < substeps; ++j) state = step(field, task, t + j * h, h, state, dipole);
    }
    return state;
}

// Out of line: inlined twice into the loop below, GCC 12 spills and the loop takes twice as long.
[[gnu::noinline]] Environment environment_at(const Field& field, const Task& task, double t) {
    return environment(field, task, t);
}

// The environment is evaluated once per distinct time: twice a step.
State run_shared(const Field& field, const Task& task, State state, long n_steps) {
    Vec b_before{};
    Environment start = environment_at(field, task, 0.0);
    for (long i = 0; i < n_steps; ++i) {
        const double t = static_cast<double>(i);
        const Vec b = to_body(state, start.b);
        const Vec dipole = i == 0 ? Vec{} : bdot(task, b, b_before);
        b_before = b;
        const Environment middle = environment_at(field, task, t + 0.5);
        const Environment end = environment_at(field, task, t + 1.0);
        const State k1 = derivative(task, start, state, dipole);
        const State k2 = derivative(task, middle, moved(state, 0.5, k1), dipole);
        const State k3 = derivative(task, middle, moved(state, 0.5, k2), dipole);
        const State k4 = derivative(task, end, moved(state, 1.0, k3), dipole);
        state = combined(state, 1.0, k1, k2, k3, k4);
        start = end;
    }
    return state;
}

Field loaded_field;

State from_array(const double* a) { return {a[0], a[1], a[2], a[3], {a[4], a[5], a[6]}}; }

void to_array(const State& a, double* out) {
    const double values[7] = {a.x, a.y, a.z, a.w, a.rate.x, a.rate.y, a.rate.z};
    std::copy(values, values + 7, out);
}

}  // namespace

extern "C" {

// g, h: 14 x 14 Gauss coefficients each, row n, column m [nT]. Call before anything else.
void set_coefficients(const double* g, const double* h) { loaded_field.set(g, h); }

// Field [T] at an Earth-fixed point [m].
void field(double x, double y, double z, double* out) {
    const Vec b = loaded_field.at({x, y, z});
    out[0] = b.x, out[1] = b.y, out[2] = b.z;
}

// Field [T] at `count` Earth-fixed points [m], rows of three.
void field_many(const double* points, long count, double* out) {
    for (long i = 0; i < 3 * count; i += 3)
        field(points[i], points[i + 1], points[i + 2], out + i);
}

// Final state (7 numbers) after n_steps seconds; `substeps` steps of RK4 in each second.
void detumble(const double* moments, double radius_m, double inclination_rad, double theta0_rad,
              double gain, double dipole_max, const double* initial, long n_steps, int substeps,
              double* final_state) {
    const Task task({moments[0], moments[1], moments[2]}, radius_m, inclination_rad, theta0_rad,
                    gain, dipole_max);
    to_array(run(loaded_field, task, from_array(initial), n_steps, substeps), final_state);
}

// The same with one step a second and the environment shared between stages.
void detumble_shared(const double* moments, double radius_m, double inclination_rad,
                     double theta0_rad, double gain, double dipole_max, const double* initial,
                     long n_steps, double* final_state) {
    const Task task({moments[0], moments[1], moments[2]}, radius_m, inclination_rad, theta0_rad,
                    gain, dipole_max);
    to_array(run_shared(loaded_field, task, from_array(initial), n_steps), final_state);
}

}  // extern "C"

namespace {

bool read_coefficients(const char* path) {
    double g[(DEGREE + 1) * (DEGREE + 1)] = {}, h[(DEGREE + 1) * (DEGREE + 1)] = {};
    std::FILE* file = std::fopen(path, "r");
    if (!file) return false;
    int n, m, count = 0;
    double g_nm, h_nm;
    while (std::fscanf(file, "%d %d %lf %lf", &n, &m, &g_nm, &h_nm) == 4) {
        if (n < 0 || n > DEGREE || m < 0 || m > n) continue;
        g[n * (DEGREE + 1) + m] = g_nm;
        h[n * (DEGREE + 1) + m] = h_nm;
        ++count;
    }
    std::fclose(file);
    loaded_field.set(g, h);
    return count > 0;
}

// Value of `key=` among the arguments, or the default.
double option(int argc, char** argv, const char* key, double otherwise) {
    const std::string prefix = std::string(key) + "=";
    for (int i = 2; i < argc; ++i)
        if (std::strncmp(argv[i], prefix.c_str(), prefix.size()) == 0)
            return std::atof(argv[i] + prefix.size());
    return otherwise;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2 || !read_coefficients(argv[1])) {
        std::fprintf(stderr, "usage: detumble coefficients.txt [key=value ...] (lines: n m g h)\n");
        return 2;
    }
    const auto value = [&](const char* key, double otherwise) {
        return option(argc, argv, key, otherwise);
    };
    const double radius_m = 1e3 * value("radius_km", 6850.0);
    const double rate = DEGREE_TO_RAD * value("rate_deg_s", 10.0);
    const Task task({value("jx", 1.0255), value("jy", 1.5393), value("jz", 1.8172)}, radius_m,
                    DEGREE_TO_RAD * value("inclination_deg", 51.7),
                    DEGREE_TO_RAD * value("theta0_deg", 0.0), value("gain", 1e6),
                    value("dipole_max", 3.2));
    const double period_s = 2.0 * M_PI / task.orbit_rate;
    const long n_steps = std::lround(value("steps", 10.0 * period_s));
    const State initial{0.0, 0.0, 0.0, 1.0, {rate, rate, rate}};
    const auto begin = std::chrono::steady_clock::now();
    double a[7];
    to_array(run(loaded_field, task, initial, n_steps, 1), a);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    std::printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", a[0], a[1], a[2], a[3], a[4], a[5],
                a[6]);
    std::fprintf(stderr, "%ld steps, %.3f us a step\n", n_steps, 1e6 * spent.count() / n_steps);
}
