// The axes of symmetric 3 x 3 matrices, such as covariances.
#pragma once

#include <cmath>

// Turn the axes p and q of a symmetric matrix by the angle that makes the element between them 0.
inline void rotate(double a[3][3], double v[3][3], int p, int q) {
    if (a[p][q] == 0.0) return;
    const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
    const double t = (theta < 0 ? -1.0 : 1.0) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
    const double c = 1 / std::sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < 3; ++k) {
        const double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - s * kq;
        a[k][q] = s * kp + c * kq;
    }
    for (int k = 0; k < 3; ++k) {
        const double pk = a[p][k], qk = a[q][k], kp = v[k][p], kq = v[k][q];
        a[p][k] = c * pk - s * qk;
        a[q][k] = s * pk + c * qk;
        v[k][p] = c * kp - s * kq;
        v[k][q] = s * kp + c * kq;
    }
}

// Turn a symmetric matrix until it is diagonal, by Jacobi's method: its eigenvalues are left on the diagonal, their directions are
// the columns of `v`.
inline void diagonalize(double a[3][3], double v[3][3]) {
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) v[i][j] = i == j;
    }
    const double size = std::fabs(a[0][0]) + std::fabs(a[1][1]) + std::fabs(a[2][2]);
    for (int sweep = 0; sweep < 12; ++sweep) {
        if (!(std::fabs(a[0][1]) + std::fabs(a[0][2]) + std::fabs(a[1][2]) > 1e-17 * size)) break;
        rotate(a, v, 0, 1);
        rotate(a, v, 0, 2);
        rotate(a, v, 1, 2);
    }
}
