// The axes of small symmetric matrices, such as covariances.
#pragma once

#include <cmath>
#include <cstddef>

// Turn the axes p and q of a symmetric matrix by the angle that makes the element between them 0.
template <std::size_t N>
void rotate(double (&a)[N][N], double (&v)[N][N], std::size_t p, std::size_t q) {
    if (a[p][q] == 0.0) return;
    const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    const double t = (theta < 0 ? -1.0 : 1.0) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
    const double c = 1 / std::sqrt(t * t + 1), s = t * c;
    for (std::size_t k = 0; k < N; ++k) {
        const double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - s * kq;
        a[k][q] = s * kp + c * kq;
    }
    for (std::size_t k = 0; k < N; ++k) {
        const double pk = a[p][k], qk = a[q][k], kp = v[k][p], kq = v[k][q];
        a[p][k] = c * pk - s * qk;
        a[q][k] = s * pk + c * qk;
        v[k][p] = c * kp - s * kq;
        v[k][q] = s * kp + c * kq;
    }
}

// Turn a symmetric matrix until it is diagonal, by Jacobi's method: its eigenvalues are left on the diagonal, their directions are
// the columns of `v`.
template <std::size_t N>
void diagonalize(double (&a)[N][N], double (&v)[N][N]) {
    double size = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
        size += std::fabs(a[i][i]);
        for (std::size_t j = 0; j < N; ++j) v[i][j] = i == j;
    }
    for (int sweep = 0; sweep < 12; ++sweep) {
        double beside = 0.0;
        for (std::size_t p = 0; p < N; ++p) {
            for (std::size_t q = p + 1; q < N; ++q) beside += std::fabs(a[p][q]);
        }
        if (!(beside > 1e-17 * size)) break;
        for (std::size_t p = 0; p < N; ++p) {
            for (std::size_t q = p + 1; q < N; ++q) rotate(a, v, p, q);
        }
    }
}
