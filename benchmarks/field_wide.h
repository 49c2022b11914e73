// The field of detumble.cpp with four orders m in one vector register (GCC vector extension):
// what hand vectorisation gives. Same recursions, same terms, another order of summation.

#pragma once

#include <cmath>

struct WideField {
    typedef double Four __attribute__((vector_size(32)));
    static constexpr int BLOCKS = (DEGREE + 4) / 4;
    static constexpr int WIDTH = 4 * BLOCKS;

    union Row {
        double at[WIDTH];
        Four block[BLOCKS];
    };
    Row rise[DEGREE + 1], fall[DEGREE + 1], g_t[DEGREE + 1], h_t[DEGREE + 1];
    double sectoral[DEGREE + 1];

    // g, h: (DEGREE + 1)^2 numbers each, row n, column m [nT].
    void set(const double* g, const double* h) {
        *this = WideField{};
        for (int m = 0; m <= DEGREE; ++m) {
            sectoral[m] = m < 2 ? 1.0 : sectoral[m - 1] * std::sqrt((2.0 * m - 1.0) / (2.0 * m));
            for (int n = m; n <= DEGREE; ++n) {
                const double norm = static_cast<double>(n) * n - static_cast<double>(m) * m;
                const double before = (n - 1.0) * (n - 1.0) - static_cast<double>(m) * m;
                rise[n].at[m] = n > m ? (2.0 * n - 1.0) / std::sqrt(norm) : 0.0;
                fall[n].at[m] = n > m ? std::sqrt(before / norm) : 0.0;
                g_t[n].at[m] = 1e-9 * g[n * (DEGREE + 1) + m];
                h_t[n].at[m] = 1e-9 * h[n * (DEGREE + 1) + m];
            }
        }
    }

    // Field [T] at an Earth-fixed point [m].
    Vec at(Vec r) const {
        const double inverse = 1.0 / std::sqrt(r.x * r.x + r.y * r.y + r.z * r.z);
        const double s = r.x * inverse, t = r.y * inverse, u = r.z * inverse;
        const double q = FIELD_RADIUS_M * inverse, qq = q * q, uq = u * q;
        Row first{}, re{}, im{}, re_slope{}, im_slope{};  // (s + i t)^m and m (s + i t)^(m - 1)
        double q_power = qq;
        first.at[0] = q_power, re.at[0] = 1.0;
        for (int m = 1; m <= DEGREE; ++m) {
            first.at[m] = sectoral[m] * (q_power *= q);
            re_slope.at[m] = m * re.at[m - 1], im_slope.at[m] = m * im.at[m - 1];
            re.at[m] = s * re.at[m - 1] - t * im.at[m - 1];
            im.at[m] = s * im.at[m - 1] + t * re.at[m - 1];
        }
        Four along_x{}, along_y{}, along_z{}, along_r{};
#pragma GCC unroll 4
        for (int b = 0; b < BLOCKS; ++b) {
            Four p{}, p1{}, d{}, d1{}, g_p{}, h_p{}, g_r{}, h_r{}, g_d{}, h_d{};
#pragma GCC unroll 16
            for (int n = 4 * b; n <= DEGREE; ++n) {
                const Four up = rise[n].block[b], down = fall[n].block[b] * qq;
                const Four d2 = up * (uq * d + q * p) - down * d1;
                Four p2 = up * uq * p - down * p1;
                if (n < 4 * b + 4) p2[n - 4 * b] = first.at[n];
                d1 = d, d = d2, p1 = p, p = p2;
                const Four g = g_t[n].block[b], h = h_t[n].block[b], gp = g * p, hp = h * p;
                g_p += gp, h_p += hp, g_d += g * d, h_d += h * d;
                g_r += (n + 1.0) * gp, h_r += (n + 1.0) * hp;
            }
            along_x += g_p * re_slope.block[b] + h_p * im_slope.block[b];
            along_y += h_p * re_slope.block[b] - g_p * im_slope.block[b];
            along_z += g_d * re.block[b] + h_d * im.block[b];
            along_r += g_r * re.block[b] + h_r * im.block[b];
        }
        const double x = sum(along_x), y = sum(along_y), z = sum(along_z);
        const double radial = sum(along_r) + s * x + t * y + u * z;
        return {radial * s - x, radial * t - y, radial * u - z};
    }

    static double sum(Four a) { return (a[0] + a[1]) + (a[2] + a[3]); }
};
